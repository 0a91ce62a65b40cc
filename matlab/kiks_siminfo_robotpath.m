function path_xy = kiks_siminfo_robotpath(port)
% kiks_siminfo_robotpath  Return the path of a simulated robot.
%
%   path_xy = kiks_siminfo_robotpath() is 2xN: row 1 x, row 2 y [mm] of this program's robot since its kiks_kopen. It is
%   2x0 before a session. There are 25 points a second, but at most KIKS_TRACE_MAX (32768): when there are more,
%   every second one is dropped, and half as many come from then on.
%
%   kiks_siminfo_robotpath(port) is for port -1, -2, ...; port may be a reference.
%
%   Example:
%     ref = kiks_kopen; kSetSpeed(ref, 5, 5); kiks_pause(1), size(kiks_siminfo_robotpath), kiks_kclose(ref)
%
%   See also kiks_siminfo_robotpos, kiks_siminfo_robotdist.

if nargin < 1
    port = -1;
end
number = simulated_port(port);
path_xy = zeros(2, 0);
if is_active()
    payload = simulator(sprintf('path %d', number));
    if ~isempty(payload)
        path_xy = matrix_of(payload);
    end
end
end
