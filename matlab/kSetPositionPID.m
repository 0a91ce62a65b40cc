function result = kSetPositionPID(ref, Kp, Ki, Kd)
% kSetPositionPID  Set the gains of the position controllers.
%
%   result = kSetPositionPID(ref, Kp, Ki, Kd) sets the gains of robot ref that kMoveTo works with, for both wheels
%   [whole numbers, 0..32767]. What is left out, or [], is as after the power-on: 3000, 20, 4000. Returns 0, or -1 if
%   the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetPositionPID(ref, 2000, 20, 4000);
%     kSetPositionPID(ref);      % as it was
%     kiks_kclose(ref)
%
%   See also kSetSpeedPID, kMoveTo.

if nargin < 1
    ref = [];
end
if nargin < 2 || isempty(Kp)
    Kp = 3000;
end
if nargin < 3 || isempty(Ki)
    Ki = 20;
end
if nargin < 4 || isempty(Kd)
    Kd = 4000;
end
result = kask(ref, ['F' parameters([Kp Ki Kd], 3, 'gains', 'kSetPositionPID(ref, 3000, 20, 4000)')], 'f', 0, 1);
end
