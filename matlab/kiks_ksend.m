function reply = kiks_ksend(cmd, ref, timeout)
% kiks_ksend  Send a command and return the robot's reply.
%
%   reply = kiks_ksend(cmd, ref) sends the text cmd, which ends in a line feed (10) or carriage return (13), and returns
%   the reply without its line end. With an empty cmd only time passes.
%
%   As in KiKS 2.2.0, a simulated robot takes a cmd without such an end as a whole command, and rounds numbers with a
%   decimal point. A real robot waits for the end, and answers z,Protocol error to D,5.5,5.
%
%   kiks_ksend(cmd, ref, timeout) waits for a real robot for timeout seconds; a simulated one needs none.
%
%   An error if the port is not open, if ref has fewer than 4 elements, or if cmd is no text.
%
%   Example:
%     ref = kiks_kopen; kiks_ksend(['D,5,5' 10], ref), kiks_kclose(ref)
%
%   See also kiks_kopen, kcmd.

if nargin < 2
    ref = [];
end
if ~isnumeric(ref) || numel(ref) < 4
    need_ref(ref);
end
if ref(1) >= 0
    if nargin < 3
        reply = ksend(cmd, ref);
    else
        reply = ksend(cmd, ref, timeout);
    end
    return
end
if ischar(cmd) && sum(cmd == 10) == 1 && cmd(end) == 10
    % What programs send thousands of times a second.
    if ref(1) == -1
        reply = simulator(['ask 1 ' cmd(1:end - 1)]);
    else
        reply = simulator([sprintf('ask %d ', -ref(1)) cmd(1:end - 1)]);
    end
elseif isempty(cmd)
    simulator(sprintf('pass %d', -ref(1)));
    reply = '';
else
    reply = simulator([sprintf('send %d ', -ref(1)) escaped(char(checked_command(cmd)))]);
end
end
