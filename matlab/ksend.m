function reply = ksend(cmd, ref, timeout)
% ksend  Send a command to a real robot and return its reply.
%
%   reply = ksend(cmd, ref) sends the text cmd, which ends in a line feed or a carriage return (character 10 or 13), to
%   robot ref and returns the reply without its line end, or '' if none comes within the timeout that kopen was given.
%   ksend(cmd, ref, timeout) waits for another time [s].
%
%   A reply that comes later is dropped: it never answers another command. An empty cmd sends nothing. A cmd without an
%   end is sent, and the reply is ''. A simulated ref is passed on to kiks_ksend. It is an error if the port is not open
%   or the connection is lost.
%
%   Example:
%     ref = kopen('/dev/ttyUSB0', 9600, 1);
%     ksend(['N' 10], ref)      % n,24,0,0,0,0,0,401,927
%     kclose(ref)
%
%   See also kcmd, ksends, kopen, kiks_ksend.

if nargin < 2 || numel(ref) < 4
    error('kiks:argument', ['ksend needs a command and what kopen has returned, four numbers. ' ...
        'Give ksend([''N'' 10], kopen([0 9600 1])).']);
end
if ref(1) < 0
    reply = kiks_ksend(cmd, ref);
    return
end
if nargin < 3 || isempty(timeout)
    timeout = ref(3);
elseif ~isnumeric(timeout) || ~isscalar(timeout) || ~(timeout >= 0)
    error('kiks:argument', 'timeout must be a time from 0 on [s], but it was %s. Give 1.', shown(timeout));
end
cmd = checked_command(cmd);
if isempty(cmd)
    reply = '';
elseif cmd(end) == 10 || cmd(end) == 13
    reply = robot_link('ask', ref(1), cmd, timeout);
else
    robot_link('send', ref(1), cmd);
    reply = '';
end
end
