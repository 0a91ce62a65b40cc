function text = kTeam(ref)
% kTeam  Ask the robot about the team that made it.
%
%   kTeam(ref) prints what robot ref says about its makers; text = kTeam(ref) returns it.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kTeam(ref)
%     kiks_kclose(ref)
%
%   See also kList.

if nargin < 1
    ref = [];
end
lines = kcmd(ref, 'k-team', 1);
if nargout > 0
    text = lines;
else
    fprintf('%s\n', lines);
end
end
