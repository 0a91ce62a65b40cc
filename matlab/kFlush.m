function text = kFlush(ref)
% kFlush  Discard unread characters of the robot.
%
%   kFlush(ref) sends a blank to robot ref, which replies with an error, and reads until it is silent. Afterwards
%   replies and commands match again. text = kFlush(ref) returns the characters read.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kFlush(ref)
%     kiks_kclose(ref)
%
%   See also kcmd.

if nargin < 1
    ref = [];
end
flushed = kcmd(ref, ' ', 1);
if nargout > 0
    text = flushed;
end
end
