function status = kRadio_status(ref)
% kRadio_status  Ask for the state of the radio.
%
%   status = kRadio_status(ref) returns [ready received failed], 1x3, of the radio turret of robot ref: 1 or 0 for
%   whether it can send, has a message to read, and could not send the last one. [] if there is no radio or it does not
%   answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     status = kRadio_status(ref);
%     if ~isempty(status) && status(2), message = kRadio_read(ref); end
%     kiks_kclose(ref)
%
%   See also kRadio_read, kRadio_send.

if nargin < 1
    ref = [];
end
bits = kask(ref, 'T,4,F', 't,4,f', 1, 1);
if bits < 0
    status = [];
else
    status = double([bitand(bits, 1) > 0, bitand(bits, 2) > 0, bitand(bits, 4) > 0]);
end
end
