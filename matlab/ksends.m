function ksends(cmd, ref)
% ksends  Send a command to a robot and do not wait for its reply.
%
%   ksends(cmd, ref) sends the text cmd, which ends in a line feed or a carriage return, to robot ref. Its reply is
%   dropped before the next command is sent. A simulated robot's reply is awaited, as that lets its time pass.
%
%   Example:
%     ref = kopen('/dev/ttyUSB0', 9600, 1);
%     ksends(['D,5,5' 10], ref);
%     kclose(ref)
%
%   See also ksend, kcmd.

if nargin < 2 || numel(ref) < 4
    error('kiks:argument', ['ksends needs a command and what kopen has returned, four numbers. ' ...
        'Give ksends([''D,0,0'' 10], kopen([0 9600 1])).']);
end
if ref(1) < 0
    kiks_ksend(cmd, ref);
    return
end
cmd = checked_command(cmd);
if ~isempty(cmd)
    robot_link('send', ref(1), cmd);
end
end
