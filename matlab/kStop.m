function result = kStop(ref)
% kStop  Stop the robot.
%
%   result = kStop(ref) sets the speeds of both wheels of robot ref to 0. Returns 0, or -1 if it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetSpeed(ref, 5, 5);
%     kiks_pause(1);
%     kStop(ref);
%     kiks_kclose(ref)
%
%   See also kSetSpeed.

if nargin < 1
    ref = [];
end
result = kask(ref, 'D,0,0', 'd', 0, 1);
end
