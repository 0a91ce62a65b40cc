function values = kProximity(ref)
% kProximity  Read the proximity sensors.
%
%   values = kProximity(ref) asks robot ref and returns the eight readings as a column, 8x1 [counts, 0..1023, larger is
%   nearer], in the order left, front-left, front (left), front (right), front-right, right, rear right, rear left;
%   -1 if the robot does not answer in three tries.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     values = kProximity(ref);
%     if max(values(2:5)) > 200, disp('something is ahead'), end
%     kiks_kclose(ref)
%
%   See also kAmbient, kProximityG, kSetSpeed.

if nargin < 1
    ref = [];
end
values = kask(ref, 'N', 'n', 8, 3);
end
