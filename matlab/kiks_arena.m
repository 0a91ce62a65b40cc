function kiks_arena(arena, colormask, nokhep)
% kiks_arena  Replace the world by another one.
%
%   kiks_arena(arena, colormask) takes robots and things away and begins a new world, with new robots; it starts a
%   session if there is none. For arena and colormask see kiks; without them the default arena comes. Ports have to be
%   opened again. Preferences are read anew.
%
%   A third argument that is not empty made a world without a robot in KiKS 2.2.0. Here a world has at least one, and a
%   line says so.
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
if nargin > 2 && ~isempty(nokhep)
    say_once('kiks_arena', ['kiks_arena: a world has at least one robot, so the third argument has no effect. ' ...
        'kiks_siminfo_setrobot moves the robot out of the way.']);
end
begin_world(arena, colormask);
end
