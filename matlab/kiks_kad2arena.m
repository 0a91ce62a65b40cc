function [arena, colormask] = kiks_kad2arena(walls)
% kiks_kad2arena  Draw the walls of an arena file .kad.
%
%   [arena, colormask] = kiks_kad2arena(walls) takes the variable walls of a .kad file: width and height [mm], then for
%   each piece a count n of corners, their n columns and n rows, counted from 1 with both ends included, and a grey.
%   arena is logical, true where there is wall; colormask is uint8, its greys. Later pieces cover earlier ones with
%   the whole box around their corners. An error if walls is damaged.
%
%   Example:
%     walls = [400 300, 4, 1 400 400 1, 1 1 10 10, 255];
%     [arena, colormask] = kiks_kad2arena(walls); nnz(arena)
%
%   See also kiks_load, kiks_tif2arena.

if nargin < 1 || ~isnumeric(walls) || ~isvector(walls) || numel(walls) < 2
    if nargin < 1
        walls = [];
    end
    error('kiks:argument', ['walls must be a vector that begins with width and height, but it was %s. Load the ' ...
        'file: data = load(''-mat'', ''arena.kad''), data.walls.'], shown(walls));
end
walls = double(walls(:)');
wrong = find(~(walls >= 0 & walls <= 65535 & walls == fix(walls)), 1);
if ~isempty(wrong)
    error('kiks:argument', ['walls must hold whole numbers from 0 to 65535, but number %d is %g. ' ...
        'Is the file an arena of KiKS?'], wrong, walls(wrong));
end
width = walls(1);
height = walls(2);
if min(width, height) < 1 || width * height > 64e6
    error('kiks:argument', ['An arena must have a width and a height of at least 1 mm and at most 64 million mm^2, ' ...
        'but walls begins with %d x %d. Is the file an arena of KiKS?'], width, height);
end
colormask = zeros(height, width, 'uint8');
position = 3;
while position <= numel(walls)
    count = walls(position);
    last = position + 2 * count + 1;
    if count < 1 || last > numel(walls)
        error('kiks:argument', ['walls must consist of whole pieces, but at its number %d a piece of %d corners ' ...
            'begins and %d numbers follow. The file was cut short.'], position, count, numel(walls) - position);
    end
    x = walls(position + 1:position + count);
    y = walls(position + count + 1:last - 1);
    grey = walls(last);
    if min([x y]) < 1 || max(x) > width || max(y) > height || grey > 255
        error('kiks:argument', ['The piece at number %d of walls must lie within %d x %d mm and have a grey up to ' ...
            '255, but its columns are %d to %d, its rows %d to %d, its grey %d. Save the arena again.'], ...
            position, width, height, min(x), max(x), min(y), max(y), grey);
    end
    rows = min(y):max(y);
    columns = min(x):max(x);
    colormask(rows, columns) = grey * inside(x, y, rows, columns);
    position = last + 1;
end
arena = colormask > 0;
end

function is_inside = inside(x, y, rows, columns)
is_corner = (x == columns(1) | x == columns(end)) & (y == rows(1) | y == rows(end));
count = numel(unique(columns([1 end]))) * numel(unique(rows([1 end])));
if all(is_corner) && size(unique([x' y'], 'rows'), 1) == count
    is_inside = true(numel(rows), numel(columns));  % a rectangle
else
    [all_x, all_y] = meshgrid(columns, rows);
    is_inside = inpolygon(all_x, all_y, x, y);
end
end
