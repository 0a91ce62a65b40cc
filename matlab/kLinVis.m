function pixels = kLinVis(ref)
% kLinVis  Read a picture of the linear camera.
%
%   pixels = kLinVis(ref) returns the 64 pixels of the K213 turret of robot ref, 64x1 [0 black .. 255 white, the
%   leftmost first]; -1 if there is no camera or it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 19200 1]);
%     pixels = kLinVis(ref);
%     [brightest, at] = max(pixels);
%     kiks_kclose(ref)
%
%   See also kLinLight, kTurret.

if nargin < 1
    ref = [];
end
pixels = kask(ref, 'T,2,N', 't,2,n', 64, 1);
end
