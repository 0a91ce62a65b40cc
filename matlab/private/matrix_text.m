function text = matrix_text(matrix)
% matrix_text  Write a matrix of whole numbers as run lengths, down its columns.
%
%   text = matrix_text(matrix) is 'rows columns count value count value ...'.
%
%   See also matrix_of.

values = double(matrix(:));
ends = [find(diff(values) ~= 0); numel(values)];
ends = ends(ends > 0);
runs = [diff([0; ends])'; values(ends)'];
text = sprintf('%d %d%s', size(matrix, 1), size(matrix, 2), sprintf(' %d %.10g', runs));
end
