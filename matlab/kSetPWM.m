function result = kSetPWM(ref, left, right)
% kSetPWM  Set the power of the motors, without control of the speed.
%
%   result = kSetPWM(ref, left, right) sets the pulse widths of robot ref [-255..255, 0 is off, 255 full forward;
%   rounded] until the next order. Returns 0, or -1 if the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetPWM(ref, 50, 50);
%     kiks_pause(1);
%     kStop(ref);
%     kiks_kclose(ref)
%
%   See also kSetSpeed, kStop.

if nargin < 3
    error('kiks:argument', 'kSetPWM needs the pulse widths of both motors. Give kSetPWM(ref, 50, 50).');
end
result = kask(ref, ['P' parameters([left right], 2, 'pulse width [-255..255]', 'kSetPWM(ref, 50, 50)')], 'p', 0, 1);
end
