function text = parameters(numbers, count, what, example)
% parameters  Write numbers as the parameters of a command: rounded, with a comma before each.
%
%   text = parameters(numbers, count, what, example) refuses what is not count finite numbers. The message says what
%   they must be, with the unit, and gives example as a right call.

% Programs set speeds thousands of times a second: the sum is finite if all are, and costs one call less.
if numel(numbers) ~= count || ~(isnumeric(numbers) || islogical(numbers)) || ~isreal(numbers) || ...
        ~isfinite(sum(numbers))
    error('kiks:argument', '%s must be %s, but it was %s. Give %s.', what, in_words(count), shown(numbers), example);
end
% Adding 0 makes 0 of -0, which would be written with its sign.
text = sprintf(',%d', round(numbers) + 0);
end

function text = in_words(count)
words = {'one finite number', 'two finite numbers', 'three finite numbers', 'four finite numbers'};
text = words{count};
end
