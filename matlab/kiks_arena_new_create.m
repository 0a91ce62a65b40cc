function [arena, colormask] = kiks_arena_new_create(h, w, rounded, colour)
% kiks_arena_new_create  Make an empty arena the world.
%
%   kiks_arena_new_create(h, w, rounded, colour) begins a new world h mm high and w mm wide with walls of 10 mm.
%   rounded other than 0 gives it round corners, of radius 100 mm or half its shorter side inside, whichever is less.
%   colour is the brightness of the walls, 1 black to 255 white; 255 if it is left out. h and w are whole numbers from
%   100 on.
%
%   [arena, colormask] = kiks_arena_new_create(...) returns it instead, to draw in.
%
%   Example:
%     kiks_arena_new_create(400, 600, 1), kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_arena.

if nargin < 2
    error('kiks:argument', 'Height and width must be given in mm. Call kiks_arena_new_create(400, 600).');
end
if nargin < 3 || isempty(rounded)
    rounded = 0;
end
if nargin < 4 || isempty(colour)
    colour = 255;
end
advice = 'Call kiks_arena_new_create(400, 600).';
check_whole('The height', h, 100, 64e4, advice);
check_whole('The width', w, 100, 64e4, advice);
check_whole('The colour', colour, 1, 255, '1 is black, 255 white.');
if h * w > 64e6
    error('kiks:argument', ['An arena must have at most 64 million mm^2, but it would have %d x %d mm. ' ...
        'Make it smaller.'], w, h);
end
is_wall = true(h, w);
is_wall(11:end - 10, 11:end - 10) = false;
if any(rounded)
    radius = min(100, floor(min(h, w) / 2) - 10);
    % How far the middles of the corner's cells are from the centre of its arc.
    away = radius - (1:radius) + 0.5;
    corner = bsxfun(@plus, away.^2, (away.^2)') > radius^2;
    near = 10 + (1:radius);
    rows = h + 1 - near;
    columns = w + 1 - near;
    is_wall(near, near) = corner;
    is_wall(near, columns) = corner;
    is_wall(rows, near) = corner;
    is_wall(rows, columns) = corner;
end
if nargout > 0
    arena = is_wall;
    colormask = uint8(colour * is_wall);
else
    begin_world(is_wall, colour * is_wall);
end
end
