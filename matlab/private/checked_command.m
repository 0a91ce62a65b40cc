function cmd = checked_command(cmd)
% checked_command  Check a command: it must be a row of characters or of their numbers.

cmd = plain_text(cmd);
if isempty(cmd) && (ischar(cmd) || isnumeric(cmd))
    cmd = '';
elseif ~(ischar(cmd) || isnumeric(cmd)) || size(cmd, 1) ~= 1 || any(~(cmd >= 0 & cmd <= 255))
    error('kiks:argument', ['cmd must be a row of text that ends in a line feed, but it was %s. ' ...
        'Give [''N'' 10].'], shown(cmd));
end
end
