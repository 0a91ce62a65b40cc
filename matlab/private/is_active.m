function active = is_active()
% is_active  Tell whether there is a session: the simulator's process with a world in it.

active = simulator('--is-running', []) && strcmp(simulator('active'), '1');
end
