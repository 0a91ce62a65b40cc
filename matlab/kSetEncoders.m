function result = kSetEncoders(ref, left, right)
% kSetEncoders  Set the counters of the wheels.
%
%   result = kSetEncoders(ref, left, right) sets the counters of robot ref [pulses, rounded; 1 is about 0.08 mm]; both
%   are 0 if left out. The robot does not move. Returns 0, or -1 if it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetEncoders(ref);
%     kGetEncoders(ref)      % [0; 0]
%     kiks_kclose(ref)
%
%   See also kGetEncoders, kMoveTo, kiks_mm2p.

if nargin < 1
    ref = [];
end
if nargin < 2 || isempty(left)
    left = 0;
end
if nargin < 3 || isempty(right)
    right = 0;
end
result = kask(ref, ['G' parameters([left right], 2, 'counters [pulses]', 'kSetEncoders(ref, 0, 0)')], 'g', 0, 1);
end
