function value = kGetAnalog(ref, channel)
% kGetAnalog  Read an analogue input.
%
%   value = kGetAnalog(ref, channel) returns the reading of a channel, 0 to 6, of robot ref [0..1023, 1 is 4 mV]; -1 if
%   the robot does not answer or has no such channel. Channels 3, 4 and 5 are free for turrets.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     volts = 0.004 * kGetAnalog(ref, 3)
%     kiks_kclose(ref)
%
%   See also kReadByte.

if nargin < 2
    error('kiks:argument', 'kGetAnalog needs the channel. Give kGetAnalog(ref, 3).');
end
value = kask(ref, ['I' parameters(channel, 1, 'channel', 'kGetAnalog(ref, 3)')], 'i', 1, 1);
end
