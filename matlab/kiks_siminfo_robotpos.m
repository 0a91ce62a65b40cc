function pos = kiks_siminfo_robotpos(port)
% kiks_siminfo_robotpos  Return the pose of a simulated robot.
%
%   pos = kiks_siminfo_robotpos() is [x y angle] of this program's robot [mm, mm, rad]: x from 1 to the right, y from 1
%   down, the angle counter-clockwise, 0 looking right, not wrapped. pos is [] before a session, and in a world without
%   a robot (kiks_arena).
%
%   kiks_siminfo_robotpos(port) is for port -1, -2, ...; port may be a reference.
%
%   Example:
%     kiks, kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_siminfo_setrobot, kiks_siminfo_robotpath.

if nargin < 1
    port = -1;
end
number = simulated_port(port);
pos = [];
if simulator('--is-running', [])
    pos = sscanf(simulator(sprintf('pose %d', number)), '%f')';
    if isempty(pos)
        pos = [];
    end
end
end
