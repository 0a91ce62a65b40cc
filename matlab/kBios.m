function [bios, protocol] = kBios(ref)
% kBios  Ask for the versions of the robot's software.
%
%   [bios, protocol] = kBios(ref) returns the versions of the BIOS and of the protocol of robot ref.
%   versions = kBios(ref) returns both in a row, [bios protocol]. -1 if the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     [bios, protocol] = kBios(ref)
%     kiks_kclose(ref)
%
%   See also kTurretBios, kList.

if nargin < 1
    ref = [];
end
versions = kask(ref, 'B', 'b', 2, 1);
if nargout < 2
    bios = versions';
else
    bios = versions(1);
    protocol = versions(end);
end
end
