function reply = kcmd(ref, text, multiline)
% kcmd  Send a command to a robot and return its reply.
%
%   reply = kcmd(ref, text) sends text and a line feed to robot ref, simulated or real, and returns the reply without
%   its line end; '' if none comes in time. All functions that are named k... speak to the robot through this one.
%
%   reply = kcmd(ref, text, 1) is for commands that answer with several lines, such as list. It returns all that comes
%   until the robot falls silent, with a line feed between the lines. With a real robot that takes up to a second more.
%
%   A connection that is lost, or a ref that is not open, is an error.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kcmd(ref, 'N')            % n,24,0,0,0,0,0,401,927
%     kcmd(ref, 'help', 1)      % several lines
%     kiks_kclose(ref)
%
%   See also kiks_ksend, ksend, kFlush, kTurret.

if nargin < 2
    error('kiks:argument', 'kcmd needs a reference and a command. Give kcmd(ref, ''N'').');
end
reply = kiks_ksend([checked_command(text) char(10)], ref);
if nargin > 2 && any(multiline)
    if ref(1) < 0
        further = unescaped(simulator(sprintf('listen %d', -ref(1))));
    else
        further = robot_link('listen', ref(1), min(ref(3), 1));
    end
    reply = [reply char(10) further];
    reply = regexprep(reply(reply ~= 13), '\n+$', '');
end
end
