function text = kFlush(ref)
% kFlush  Take away what the robot has sent and nobody has read.
%
%   kFlush(ref) sends a blank to robot ref, which makes it complain, and reads until it is silent. Afterwards replies
%   and commands belong together again. text = kFlush(ref) returns what was read.
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
