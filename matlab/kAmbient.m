function values = kAmbient(ref)
% kAmbient  Read the ambient light sensors.
%
%   values = kAmbient(ref) asks robot ref and returns the eight readings as a column, 8x1 [counts, about 50 close to a
%   lamp to 500 in the dark], in the order of kProximity; -1 if the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     [brightest, sensor] = min(kAmbient(ref));
%     kiks_kclose(ref)
%
%   See also kProximity.

if nargin < 1
    ref = [];
end
values = kask(ref, 'O', 'o', 8, 1);
end
