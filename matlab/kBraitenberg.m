function kBraitenberg(ref, speed, seconds)
% kBraitenberg  Let the robot drive about and avoid obstacles, as Braitenberg's third vehicle does.
%
%   kBraitenberg(ref, speed, seconds) couples the proximity sensors of robot ref to its wheels. speed is a factor for
%   all speeds, 0.7 if left out: 14 pulses/10 ms with no obstacle near. It runs for that many seconds, by kiks_ktime,
%   or until Ctrl-C if they are left out. The robot stops at the end, also after Ctrl-C or an error.
%
%   A robot that does not answer is an error.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kBraitenberg(ref, 0.7, 60)
%     kiks_kclose(ref)
%
%   See also kBraitenbergG, kProximity, kSetSpeed.

if nargin < 1
    ref = [];
end
need_ref(ref);
if nargin < 2 || isempty(speed)
    speed = 0.7;
end
if nargin < 3
    seconds = [];
end
parameters(speed, 1, 'speed (a factor)', 'kBraitenberg(ref, 0.7)');
[start, seconds] = time_limit(ref, seconds);
stopper = onCleanup(@() stop_robot(ref)); %#ok<NASGU>
while seconds == Inf || kiks_ktime(ref(1)) - start < seconds
    braitenberg_step(ref, speed);
end
end
