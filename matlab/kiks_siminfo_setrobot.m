function ok = kiks_siminfo_setrobot(x, y, radians, port)
% kiks_siminfo_setrobot  Move a simulated robot to another place.
%
%   ok = kiks_siminfo_setrobot(x, y, radians) moves this program's robot to x, y [mm] with the heading radians, a random
%   one if it is left out or []. ok is 1; it is 0, and nothing changes, if the place is not free, if x or y is missing,
%   or before a session. An open port stays open. In a world without a robot (kiks_arena), one comes before it is moved.
%
%   kiks_siminfo_setrobot(x, y, radians, port) is for port -1, -2, ...; port may be a reference.
%
%   Example:
%     kiks, kiks_siminfo_setrobot(100, 200, pi / 2), kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_siminfo_robotpos, kiks_reset.

if nargin < 3 || isempty(radians)
    radians = NaN;
end
if nargin < 4
    port = -1;
end
number = simulated_port(port);
ok = 0;
if nargin < 2
    return
end
is_number = @(value) isnumeric(value) && isscalar(value) && ~isinf(value);
if ~is_number(x) || ~is_number(y) || ~is_number(radians) || isnan(x) || isnan(y)
    error('kiks:argument', ['x, y [mm] and the heading [rad] must be finite numbers, but they were %s, %s and %s. ' ...
        'Call kiks_siminfo_setrobot(100, 200, 0).'], shown(x), shown(y), shown(radians));
end
check_heading(radians);
if is_active()
    ok = str2double(simulator(sprintf('set_robot %d %.17g %.17g %.17g', number, x, y, radians)));
end
end
