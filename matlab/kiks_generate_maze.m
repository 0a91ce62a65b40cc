function arena = kiks_generate_maze(xs, ys, path_width, wall_width)
% kiks_generate_maze  Make a random maze.
%
%   arena = kiks_generate_maze(xs, ys, path_width, wall_width) is an arena matrix with xs x ys cells (4 x 4), paths of
%   path_width (120) and walls of wall_width (10) [mm]. Its size is ys*path_width + (ys-1)*wall_width rows and
%   (xs+2)*path_width + (xs-1)*wall_width columns: the entrance is an extra cell left of the top row, the exit one right
%   of the bottom row. A robot starts in the entrance and looks right; a light hangs in the exit. Around it is a wall of
%   10 mm, 11 mm right and below, which takes its room from the outer cells.
%
%   Exactly one way leads from each place to each other, and each such maze is as likely as any other. rand draws it:
%   rand('twister', 7) before it gives the same maze again.
%
%   xs and ys are 1 to 100, wall_width is 1 to 1000, path_width at least 67, so that a Khepera fits everywhere.
%
%   Example:
%     arena = kiks_generate_maze(5, 5); size(arena)
%     kiks_arena(arena), kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_arena.

if nargin < 1 || isempty(xs)
    xs = 4;
end
if nargin < 2 || isempty(ys)
    ys = 4;
end
if nargin < 3 || isempty(path_width)
    path_width = 120;
end
if nargin < 4 || isempty(wall_width)
    wall_width = 10;
end
check_whole('xs', xs, 1, 100, 'It counts the cells side by side.');
check_whole('ys', ys, 1, 100, 'It counts the cells one above the other.');
check_whole('wall_width', wall_width, 1, 1000, 'It is in mm.');
check_whole('path_width', path_width, 67, 10000, 'A Khepera has to fit beside the outer wall.');
pitch = path_width + wall_width;
height = ys * pitch - wall_width;
width = (xs + 2) * path_width + (xs - 1) * wall_width;
if height * width > 64e6
    error('kiks:argument', ['A maze must have at most 64 million mm^2, but this one would have %d x %d mm. ' ...
        'Take fewer or smaller cells.'], width, height);
end

% Column 0 is the entrance's, column xs + 1 the exit's.
passages = [0 1 1 1; joined_cells(xs, ys); xs ys (xs + 1) ys];
arena = ones(height, width);
for k = 1:size(passages, 1)
    columns = sort(passages(k, [1 3])) * pitch - wall_width;
    rows = (sort(passages(k, [2 4])) - 1) * pitch;
    arena(rows(1) + 1:rows(2) + path_width, max(columns(1), 0) + 1:min(columns(2) + path_width, width)) = 0;
end
arena([1:10 end - 10:end], :) = 1;
arena(:, [1:10 end - 10:end]) = 1;
% In the middle of the entrance, or as near to it as the outer wall allows.
arena(max(round(path_width / 2), 38), max(round((wall_width + path_width) / 2) - wall_width, 38)) = -360;
arena((ys - 1) * pitch + round(path_width / 2), (xs + 1) * pitch + round(path_width / 2) - wall_width) = light_code();
end

function passages = joined_cells(xs, ys)
% Wilson's algorithm: each cell that is not joined yet walks at random until it meets the maze, and its way there
% without the loops becomes passages. Rows are [column row column row].
joined = false(ys, xs);
joined(ys, xs) = true;
passages = zeros(xs * ys - 1, 4);
total = 0;
onward = zeros(ys, xs);
step_x = [1 0 -1 0];
step_y = [0 1 0 -1];
for first = 1:xs * ys
    [first_y, first_x] = ind2sub([ys xs], first);
    % What a walk leaves behind at a cell is its last way out of it: following those, the loops are gone.
    x = first_x;
    y = first_y;
    while ~joined(y, x)
        way = ceil(4 * rand());
        new_x = x + step_x(way);
        new_y = y + step_y(way);
        if new_x >= 1 && new_x <= xs && new_y >= 1 && new_y <= ys
            onward(y, x) = way;
            x = new_x;
            y = new_y;
        end
    end
    x = first_x;
    y = first_y;
    while ~joined(y, x)
        joined(y, x) = true;
        way = onward(y, x);
        total = total + 1;
        passages(total, :) = [x y (x + step_x(way)) (y + step_y(way))];
        x = x + step_x(way);
        y = y + step_y(way);
    end
end
end

function code = light_code()
preferences = read_preferences();
code = 2;
if strcmp(preferences.KIKS_ARENA_CODING, 'thesis')
    code = 3;
end
end
