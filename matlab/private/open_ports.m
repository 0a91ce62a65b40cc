function numbers = open_ports(what, number)
% open_ports  The simulated ports that this program has open.
%
%   numbers = open_ports('list')    as a row: 1 for port -1, and so on
%   open_ports('add', number)
%   open_ports('remove', number)    0: all

persistent known
if isempty(known)
    mlock;  % `clear all` in a user's program leaves ports open
    known = zeros(1, 0);
end
switch what
    case 'add'
        known = union(known, number);
    case 'remove'
        if number == 0
            known = zeros(1, 0);
        else
            known = setdiff(known, number);
        end
end
numbers = known;
end
