function message = kRadio_read(ref)
% kRadio_read  Read a message that the radio has received.
%
%   message = kRadio_read(ref) returns 18 numbers, 18x1, from the radio turret of robot ref: the number of the sender,
%   how many bytes the message has, and 16 bytes, 0 after the message's end. All are 0 if there is no message. -1 if
%   there is no radio or it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     message = kRadio_read(ref);
%     if message(1) > 0, disp(char(message(3:2 + message(2))')), end
%     kiks_kclose(ref)
%
%   See also kRadio_send, kRadio_status.

if nargin < 1
    ref = [];
end
message = kask(ref, 'T,4,R', 't,4,r', 18, 1);
end
