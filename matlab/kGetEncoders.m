function values = kGetEncoders(ref)
% kGetEncoders  Read the counters of the wheels.
%
%   values = kGetEncoders(ref) returns how far the wheels of robot ref have turned, [left; right], 2x1 [pulses, forward
%   is positive]; -1 if it does not answer in three tries.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetEncoders(ref, 0, 0);
%     kSetSpeed(ref, 5, 5);
%     kiks_pause(1);
%     kiks_p2mm(mean(kGetEncoders(ref)))      % about 41 mm
%     kStop(ref);
%     kiks_kclose(ref)
%
%   See also kSetEncoders, kiks_p2mm.

if nargin < 1
    ref = [];
end
values = kask(ref, 'H', 'h', 2, 3);
end
