function preferences = read_preferences()
% read_preferences  Read kiks_preferences: the toolbox's, then the user's in the current folder, then global variables.
%
%   preferences = read_preferences() is a struct with a field for each constant, checked.

defaults = constants_of(fileparts(fileparts(mfilename('fullpath'))));
preferences = defaults;
changes = struct();
if exist(fullfile(pwd(), 'kiks_preferences.m'), 'file') == 2
    try
        changes = constants_of(pwd());
    catch failure
        error('kiks:argument', 'kiks_preferences.m in %s must run, but it did not: %s. Mend it or delete it.', ...
            pwd(), regexprep(one_line(failure.message), '\.$', ''));
    end
end
names = fieldnames(changes);
for k = 1:numel(names)
    if isfield(preferences, names{k})
        preferences.(names{k}) = changes.(names{k});
    else
        say_once(names{k}, sprintf('kiks_preferences: KiKS knows no %s. See help kiks_preferences.', ...
            one_line(names{k})));
    end
end
names = fieldnames(preferences);
for k = 1:numel(names)
    value = global_value(names{k});
    if ~isempty(value)
        preferences.(names{k}) = value;
    end
    preferences.(names{k}) = plain_text(preferences.(names{k}));
    say_idle(names{k}, preferences.(names{k}), defaults.(names{k}));
end
preferences = checked(preferences);
end

function values = constants_of(folder)
% The script runs in its own workspace, as the user's script may declare its constants global. It is not called by its
% name, as Octave caches which file that is, nor by run, which changes the current folder.
eval(fileread(fullfile(folder, 'kiks_preferences.m')));
names = who('KIKS_*');
values = struct();
for k = 1:numel(names)
    values.(names{k}) = eval(names{k});
end
end

function value = global_value(name)
eval(['global ' name]);
value = eval(name);
end

function say_idle(name, value, default)
% Say why a changed constant has no effect.
if isequal(value, default)
    return
end
switch name
    case {'KIKS_SIM_PROX_EMAX', 'KIKS_SIM_PROX_EMIN', 'KIKS_SIM_PROX_EEXP', 'KIKS_SIM_PROX_NOISE', ...
            'KIKS_SIM_LIGHT_FEXP', 'KIKS_K213_NOISE', 'KIKS_K213_NONORMALIZE'}
        reason = 'sensors and their noise are as measured on a real robot. KIKS_NOISE = 0 turns noise off';
    case {'KIKS_SIM_PROX_STEP', 'KIKS_K213_STEP', 'KIKS_MMPERPIXEL'}
        reason = 'the simulator''s rays and movements are exact';
    case {'KIKS_MOVIECOMPRESSION', 'KIKS_MOVIEQUALITY'}
        reason = 'films are H.264, in a quality of their own';
    otherwise
        return
end
say_once(name, sprintf('kiks_preferences: %s has no effect: %s.', name, reason));
end

function preferences = checked(preferences)
whole = @(value, low, high) isnumeric(value) && isscalar(value) && value >= low && value <= high && value == fix(value);
grey = @(value) isempty(value) || whole(value, 1, 255);
row_text = @(value) ischar(value) && size(value, 1) <= 1;
p = preferences;
check(whole(p.KIKS_SEED, 0, 2^53), 'KIKS_SEED', p.KIKS_SEED, 'a whole number from 0 to 2^53', '7');
check(row_text(p.KIKS_THINKING), 'KIKS_THINKING', p.KIKS_THINKING, ...
    '''live'', ''live:FACTOR'', ''fixed:MS'' or ''none''', '''fixed:2''');
check(row_text(p.KIKS_EMULATED_CPU) || isempty(p.KIKS_EMULATED_CPU) || is_positive(p.KIKS_EMULATED_CPU), ...
    'KIKS_EMULATED_CPU', p.KIKS_EMULATED_CPU, 'the name of a computer or its index', '''300 MHz Celeron-A''');
check(row_text(p.KIKS_ROBOT) && ~isempty(p.KIKS_ROBOT), 'KIKS_ROBOT', p.KIKS_ROBOT, ...
    '''Khepera'', ''Khepera_II'' or a robot''s file', '''Khepera''');
check(row_text(p.KIKS_MOVIENAME) || isempty(p.KIKS_MOVIENAME), 'KIKS_MOVIENAME', p.KIKS_MOVIENAME, ...
    'the name of a film', '''run.mp4''');
check(row_text(p.KIKS_RESPONSE), 'KIKS_RESPONSE', p.KIKS_RESPONSE, 'the name of a response', '''''');
check(isequal(p.KIKS_NOISE, 0) || isequal(p.KIKS_NOISE, 1), 'KIKS_NOISE', p.KIKS_NOISE, '0 or 1', '1');
check(row_text(p.KIKS_TURRETS), 'KIKS_TURRETS', p.KIKS_TURRETS, 'names of turrets with blanks between', ...
    '''k213 radio''');
check(isempty(p.KIKS_ROBOTS) || whole(p.KIKS_ROBOTS, 1, 1000), 'KIKS_ROBOTS', p.KIKS_ROBOTS, ...
    'a whole number from 1 to 1000, or []', '2');
check(whole(p.KIKS_PROGRAMS, 1, 1000), 'KIKS_PROGRAMS', p.KIKS_PROGRAMS, 'a whole number from 1 to 1000', '2');
check(any(strcmp(p.KIKS_ARENA_CODING, {'kiks', 'thesis'})), 'KIKS_ARENA_CODING', p.KIKS_ARENA_CODING, ...
    '''kiks'' or ''thesis''', '''kiks''');
check(isempty(p.KIKS_WINDOW) || isequal(p.KIKS_WINDOW, 0) || isequal(p.KIKS_WINDOW, 1), 'KIKS_WINDOW', ...
    p.KIKS_WINDOW, '0, 1 or []', '0');
check(grey(p.KIKS_COLOR_BALL), 'KIKS_COLOR_BALL', p.KIKS_COLOR_BALL, 'a grey from 1 to 255, or []', '255');
check(grey(p.KIKS_COLOR_CYLINDER), 'KIKS_COLOR_CYLINDER', p.KIKS_COLOR_CYLINDER, 'a grey from 1 to 255, or []', '190');
if isnumeric(p.KIKS_COLOR_ROBOT) && isscalar(p.KIKS_COLOR_ROBOT) && p.KIKS_COLOR_ROBOT < 0
    say_once('KIKS_COLOR_ROBOT', ...
        'kiks_preferences: KIKS_COLOR_ROBOT below 0 has no effect: robots are drawn without stripes.');
    preferences.KIKS_COLOR_ROBOT = [];
else
    check(grey(p.KIKS_COLOR_ROBOT), 'KIKS_COLOR_ROBOT', p.KIKS_COLOR_ROBOT, 'a grey from 1 to 255, or []', '120');
end
check(whole(p.KIKS_ARENA_DEFAULT_COLOR, 1, 255), 'KIKS_ARENA_DEFAULT_COLOR', p.KIKS_ARENA_DEFAULT_COLOR, ...
    'a grey from 1 to 255', '255');
check(whole(p.KIKS_TRACE_MAX, 2, 10^6), 'KIKS_TRACE_MAX', p.KIKS_TRACE_MAX, 'a whole number from 2 to 10^6', '8^5');
check(whole(p.KIKS_LOG_HISTORY, 1, 10^6), 'KIKS_LOG_HISTORY', p.KIKS_LOG_HISTORY, ...
    'a whole number from 1 to 10^6', '1000');
end

function yes = is_positive(value)
yes = isnumeric(value) && isscalar(value) && isfinite(value) && value > 0;
end

function check(holds, name, value, what, example)
if ~holds
    error('kiks:argument', '%s must be %s, but it was %s. Write %s = %s; into kiks_preferences.m.', ...
        name, what, shown(value), name, example);
end
end
