function reply = kRadio_send(ref, id, message, len)
% kRadio_send  Send a message by radio.
%
%   reply = kRadio_send(ref, id, message, len) sends the first len bytes of message, a text or numbers 0 to 255, from
%   the radio turret of robot ref to that with number id, and returns the reply, 't,4,s'. All of message if len is
%   left out. Returns '' and sends nothing if len is not 0 to 16. kRadio_status tells whether it has arrived.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kRadio_send(ref, 2, 'Terribly sorry!', 15);
%     kiks_kclose(ref)
%
%   See also kRadio_read, kRadio_status.

if nargin < 1
    ref = [];
end
if nargin < 3
    error('kiks:argument', 'kRadio_send needs a receiver and a message. Give kRadio_send(ref, 2, ''Hello'', 5).');
end
example = 'kRadio_send(ref, 2, ''Hello'', 5)';
bytes = -1;
if ischar(message) || isnumeric(message)
    bytes = round(double(message(:)'));
end
if ~all(bytes >= 0 & bytes <= 255)
    error('kiks:argument', 'message must be a text or numbers 0 to 255, but it was %s. Give %s.', ...
        shown(message), example);
end
if nargin < 4 || isempty(len)
    len = numel(bytes);
end
head = parameters([id len], 2, 'receiver and length', example);
len = round(len);
reply = '';
if len >= 0 && len <= 16
    % A message that is too short for its length goes on with zeros; the turret takes 16 bytes in any case.
    block = zeros(1, 16);
    kept = 1:min(len, numel(bytes));
    block(kept) = bytes(kept);
    reply = kcmd(ref, ['T,4,S' head sprintf(',%d', block)]);
end
end
