function status = kGetStatus(ref)
% kGetStatus  Read the state of the motor controllers.
%
%   status = kGetStatus(ref) returns [T; M; E] of the left wheel of robot ref, then the same of the right one, 6x1; -1
%   if it does not answer.
%     T  1 if the wheel has arrived where kMoveTo sent it, else 0
%     M  0: speed (kSetSpeed), 1: position (kMoveTo), 2: pulse width (kSetPWM)
%     E  set point minus measured value [pulses/10 ms, or pulses while M is 1]
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetEncoders(ref);
%     kMoveTo(ref, 500, 500);
%     status = kGetStatus(ref);
%     while status(1) + status(4) < 2, status = kGetStatus(ref); end
%     kiks_kclose(ref)
%
%   See also kStatus, kMoveTo, kSetSpeed.

if nargin < 1
    ref = [];
end
status = kask(ref, 'K', 'k', 6, 1);
end
