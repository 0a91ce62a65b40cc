function result = kSetSpeed(ref, left, right)
% kSetSpeed  Set the speeds of the wheels.
%
%   result = kSetSpeed(ref, left, right) lets the wheels of robot ref turn at these speeds [pulses/10 ms, -127..127,
%   rounded; 1 is about 8 mm/s] until the next order. Returns 0, or -1 if the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetSpeed(ref, 5, 5);
%     kiks_pause(2);
%     kSetSpeed(ref, 0, 0);
%     kiks_kclose(ref)
%
%   See also kGetSpeed, kStop, kMoveTo, kSetPWM.

if nargin < 3
    error('kiks:argument', 'kSetSpeed needs the speeds of both wheels. Give kSetSpeed(ref, 5, 5).');
end
result = kask(ref, ['D' parameters([left right], 2, 'speed [pulses/10 ms]', 'kSetSpeed(ref, 5, 5)')], 'd', 0, 1);
end
