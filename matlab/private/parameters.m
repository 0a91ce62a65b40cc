function text = parameters(numbers, count, what, example)
% parameters  Write numbers as the parameters of a command: rounded, with a comma before each.
%
%   text = parameters(numbers, count, what, example) stops unless there are count finite numbers. The message says what
%   they must be, with the unit, and shows example as a correct call.

% Programs set speeds thousands of times a second. A test of the sum saves a call: it is finite if all numbers are.
if numel(numbers) ~= count || ~(isnumeric(numbers) || islogical(numbers)) || ~isreal(numbers) || ...
        ~isfinite(sum(numbers))
    error('kiks:argument', '%s must be %s, but it was %s. Give %s.', what, in_words(count), shown(numbers), example);
end
% Adding 0 turns -0, which would be written with its sign, into 0.
text = sprintf(',%d', round(numbers) + 0);
end

function text = in_words(count)
words = {'one finite number', 'two finite numbers', 'three finite numbers', 'four finite numbers'};
text = words{count};
end
