function value = kReadByte(ref, address)
% kReadByte  Read a byte of the extension bus.
%
%   value = kReadByte(ref, address) returns the byte [0..255] at an address, 0 to 63, of the bus of robot ref; -1 if the
%   robot does not answer. The inputs of a General I/O turret are at 32.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     inputs = kReadByte(ref, 32)
%     kiks_kclose(ref)
%
%   See also kWriteByte, kGetAnalog.

if nargin < 2
    error('kiks:argument', 'kReadByte needs the address. Give kReadByte(ref, 32).');
end
value = kask(ref, ['R' parameters(address, 1, 'address', 'kReadByte(ref, 32)')], 'r', 1, 1);
end
