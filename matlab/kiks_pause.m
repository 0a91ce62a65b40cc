function kiks_pause(sec)
% kiks_pause  Let time pass.
%
%   kiks_pause(sec) lets sec seconds of simulated time pass, which takes as long as simulating them does, not sec
%   seconds. It is a plain pause if no simulated port is open or if a real one is. A negative sec counts as 0, so that
%   programs may wait for the rest of a period that is over.
%
%   Example:
%     ref = kiks_kopen; kSetSpeed(ref, 5, 5); kiks_pause(2), kiks_siminfo_robotpos, kiks_kclose(ref)
%
%   See also kiks_ktime.

if nargin < 1 || ~isnumeric(sec) || ~isscalar(sec) || ~isfinite(sec)
    if nargin < 1
        sec = [];
    end
    error('kiks:argument', ['A pause must be a finite number of seconds, but it was %s. ' ...
        'Call kiks_pause(0.1).'], shown(sec));
end
sec = max(sec, 0);
if ~isempty(open_ports('list')) && isempty(robot_link('numbers', []))
    simulator(sprintf('pause %.17g', sec));
else
    builtin('pause', sec);
end
end
