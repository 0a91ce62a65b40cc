function kiks_quit(silent)
% kiks_quit  End the session.
%
%   kiks_quit closes the simulated ports, ends the simulator's process and its window, and forgets the log. A session
%   that was joined goes on without this program. Without a session nothing happens.
%
%   kiks_quit(silent) says nothing if silent is not empty and not 0. Ports of real robots stay open: kclose.
%
%   Example:
%     kiks, kiks_quit
%
%   See also kiks, kiks_kclose.

open_ports('remove', 0);
poll_desk('end');
pulse_mm('forget');
global_value('KIKS_SESSIONACTIVE', []);
if simulator('--is-running', [])
    film('save', 0);
    goes_on = is_shared();
    simulator('--end', []);
    if nargin < 1 || isempty(silent) || ~any(silent)
        if goes_on
            disp('This program has left the KiKS session. The session goes on for the other programs.');
        else
            disp('The KiKS session has ended.');
        end
    end
end
clear kiks_status;
end
