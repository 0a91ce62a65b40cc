function text = kList(ref)
% kList  List the programs in the robot's memory.
%
%   kList(ref) prints the programs in the ROM of robot ref; text = kList(ref) returns them, one per line.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kList(ref)
%     kiks_kclose(ref)
%
%   See also kTeam, kBios, kcmd.

if nargin < 1
    ref = [];
end
lines = kcmd(ref, 'list', 1);
if nargout > 0
    text = lines;
else
    fprintf('%s\n', lines);
end
end
