function matrix = matrix_of(payload)
% matrix_of  Read a matrix of run lengths, as matrix_text writes it.
%
%   See also matrix_text.

numbers = sscanf(payload, '%f');
counts = numbers(3:2:end);
values = numbers(4:2:end);
ends = cumsum(counts);
matrix = zeros(numbers(1), numbers(2));
if ~isempty(ends)
    % Each value overwrites its predecessor from the start of its run.
    steps = zeros(ends(end), 1);
    steps([1; ends(1:end - 1) + 1]) = 1;
    matrix(:) = values(cumsum(steps));
end
end
