function dist = kiks_siminfo_robotdist(port)
% kiks_siminfo_robotdist  Return how far a simulated robot has driven.
%
%   dist = kiks_siminfo_robotdist() is [forward backward straight] of this program's robot since its kiks_kopen [mm]:
%   how far its centre has moved forwards and backwards, and its distance from the start. It is [] before a session.
%
%   kiks_siminfo_robotdist(port) is for port -1, -2, ...; port may be a reference.
%
%   Example:
%     ref = kiks_kopen; kSetSpeed(ref, 5, 5); kiks_pause(1), kiks_siminfo_robotdist, kiks_kclose(ref)
%
%   See also kiks_siminfo_robotpath.

if nargin < 1
    port = -1;
end
number = simulated_port(port);
dist = [];
if is_active()
    dist = sscanf(simulator(sprintf('distances %d', number)), '%f')';
end
end
