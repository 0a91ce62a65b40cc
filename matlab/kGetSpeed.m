function values = kGetSpeed(ref)
% kGetSpeed  Read the speeds of the wheels.
%
%   values = kGetSpeed(ref) returns the measured speeds [left; right] of robot ref, 2x1 [pulses/10 ms]; -1 if it does
%   not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetSpeed(ref, 5, -5);
%     kiks_pause(0.1);
%     kGetSpeed(ref)
%     kStop(ref);
%     kiks_kclose(ref)
%
%   See also kSetSpeed, kGetEncoders.

if nargin < 1
    ref = [];
end
values = kask(ref, 'E', 'e', 2, 1);
end
