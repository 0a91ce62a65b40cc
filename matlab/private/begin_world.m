function preferences = begin_world(arena, colormask, changes)
% begin_world  Begin a new world; start the simulator's process if there is none.
%
%   preferences = begin_world(arena, colormask) takes the arguments of kiks and the values of kiks_preferences, and
%   returns these values.
%   begin_world(arena, colormask, changes) takes values of the struct changes instead of those preferences.

accept_old_style();
preferences = prepare_process();
if nargin > 2
    names = fieldnames(changes);
    for k = 1:numel(names)
        preferences.(names{k}) = changes.(names{k});
    end
end
% Report errors of the arena before a process starts and opens a window.
world = world_request(plain_text(arena), colormask, preferences);
turrets = own_turrets('find');
settings = [setting_requests(preferences), {turrets}];
is_new = ~is_active();
cellfun(@simulator, settings, 'UniformOutput', false);
if is_new
    film('forget', 0);
end
film('save', 0);
for move = regexp(unescaped(simulator(world)), '[^\n]+', 'match')
    warn('kiks:arena', '%s', move{1});
end
% The ports belonged to the old world.
open_ports('remove', 0);
pulse_mm('forget');
global_value('KIKS_SESSIONACTIVE', 1);
if is_new
    address = simulator('desk');
    if ~isempty(address)
        kiks_status(['The world is shown at ' address], 1);
    end
    if is_octave() || ~isempty(address)
        poll_desk('begin');
    end
end
end
