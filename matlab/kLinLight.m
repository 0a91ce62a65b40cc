function level = kLinLight(ref)
% kLinLight  Read the light level of the linear camera.
%
%   level = kLinLight(ref) returns the high and the low byte of the light level of the K213 turret of robot ref, 2x1;
%   the level is 256 * level(1) + level(2), larger is darker. -1 if there is no camera or it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     level = kLinLight(ref);
%     kiks_kclose(ref)
%
%   See also kLinVis.

if nargin < 1
    ref = [];
end
level = kask(ref, 'T,2,L', 't,2,l', 2, 1);
end
