function t = kiks_ktime(port)
% kiks_ktime  Tell the time of a robot.
%
%   t = kiks_ktime(port) is the time since kiks_kopen of that port [s]: simulated time for port -1 (and -2, ...), real
%   time for 0, 1, .... It is [] if the port is not open. port may be the whole reference: then t is a vector of equal
%   values, as long as it. Without port it is -1.
%
%   Example:
%     ref = kiks_kopen; kProximity(ref); kiks_ktime(-1), kiks_kclose(ref)
%
%   See also kiks_kopen, kiks_pause.

persistent last
if nargin < 1
    port = -1;
end
t = [];
if isempty(port) || ~isnumeric(port)
    error('kiks:argument', 'The port must be a number or a reference, but it was %s. Call kiks_ktime(-1).', ...
        shown(port));
elseif port(1) >= 0
    t = robot_link('time', port(1));
else
    % Polling lets simulated time pass.
    t = simulator('--clock', -port(1));
    if (isempty(t) || t == last) && simulator('--is-running', [])
        t = sscanf(simulator(sprintf('time %d', -port(1))), '%f', 1);
    end
    last = t;
end
if isempty(t)
    t = [];
elseif ~isscalar(port)
    t = repmat(t, size(port));
end
end
