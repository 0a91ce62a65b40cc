function kiks_arena(arena, colormask, ~)
% kiks_arena  Replace the world by another one.
%
%   kiks_arena(arena, colormask) takes robots and things away and begins a new world, with new robots; it starts a
%   session if there is none. For arena and colormask see kiks; without them the default arena comes. Ports have to be
%   opened again. Preferences are read anew.
%
%   A third argument, with which KiKS 2.2.0 made a world without a robot, has no effect: a world has at least one.
%
%   Example:
%     kiks_arena(kiks_generate_maze(5, 5)); kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks, kiks_load, kiks_generate_maze, kiks_tif2arena.

if nargin < 1
    arena = [];
end
if nargin < 2
    colormask = [];
end
begin_world(arena, colormask);
end
