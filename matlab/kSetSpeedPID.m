function result = kSetSpeedPID(ref, Kp, Ki, Kd)
% kSetSpeedPID  Set the gains of the speed controllers.
%
%   result = kSetSpeedPID(ref, Kp, Ki, Kd) sets the gains of robot ref that kSetSpeed works with, for both wheels [whole
%   numbers, 0..32767]. What is left out, or [], is as after the power-on: 3800, 800, 100. Returns 0, or -1 if the robot
%   does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetSpeedPID(ref, 3000, 800, 100);
%     kSetSpeedPID(ref);      % as it was
%     kiks_kclose(ref)
%
%   See also kSetPositionPID, kSetSpeed.

if nargin < 1
    ref = [];
end
if nargin < 2 || isempty(Kp)
    Kp = 3800;
end
if nargin < 3 || isempty(Ki)
    Ki = 800;
end
if nargin < 4 || isempty(Kd)
    Kd = 100;
end
result = kask(ref, ['A' parameters([Kp Ki Kd], 3, 'gains', 'kSetSpeedPID(ref, 3800, 800, 100)')], 'a', 0, 1);
end
