function kiks_arena(arena, colormask, nokhep)
% kiks_arena  Replace the world by another one.
%
%   kiks_arena(arena, colormask) takes robots and things away and begins a new world, with new robots; it starts a
%   session if there is none. For arena and colormask see kiks; without them the default arena comes. Ports have to be
%   opened again. Preferences are read anew.
%
%   kiks_arena(arena, colormask, 1), or with any third argument that is not empty, makes a world without a robot. The
%   first kiks_kopen or kiks_siminfo_setrobot brings one.
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
changes = struct();
if nargin > 2 && ~isempty(nokhep)
    changes.KIKS_ROBOTS = 0;
end
begin_world(arena, colormask, changes);
end
