function result = kWriteByte(ref, data, address)
% kWriteByte  Write a byte to the extension bus.
%
%   result = kWriteByte(ref, data, address) writes a byte [0..255] to an address, 0 to 63, of the bus of robot ref. The
%   data come first. Returns 0, or -1 if the robot does not answer. The outputs of a General I/O turret are at 32.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kWriteByte(ref, 170, 32);
%     kiks_kclose(ref)
%
%   See also kReadByte.

if nargin < 3
    error('kiks:argument', 'kWriteByte needs the data and the address. Give kWriteByte(ref, 170, 32).');
end
result = kask(ref, ['W' parameters([data address], 2, 'data and address', 'kWriteByte(ref, 170, 32)')], 'w', 0, 1);
end
