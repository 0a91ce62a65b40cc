function kiks_kclose(ref)
% kiks_kclose  Close a robot's port.
%
%   kiks_kclose(ref) closes the port that kiks_kopen returned ref for, simulated or real.
%   kiks_kclose([]) closes all simulated ports of this program, whether they are open or not.
%
%   The robot keeps its last speed: stop it before, with kSetSpeed(ref, 0, 0). Not an error if the port is not open.
%
%   Example:
%     ref = kiks_kopen; kiks_kclose(ref)
%
%   See also kiks_kopen, kiks_quit.

number = 0;
if nargin > 0 && ~isempty(ref)
    if ~isnumeric(ref) || isnan(ref(1))
        error('kiks:argument', ['The reference must be what kiks_kopen returned, or [], but it was %s. ' ...
            'Call kiks_kclose(ref).'], shown(ref));
    end
    if ref(1) >= 0
        kclose(ref);
        return
    end
    number = -ref(1);
end
open_ports('remove', number);
if simulator('--is-running', [])
    simulator(sprintf('close %d', number));
    film('save', number);
end
end
