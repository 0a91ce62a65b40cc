function preferences = read_preferences()
% read_preferences  Read kiks_preferences: the toolbox's, then the user's in the current folder, then global variables.
%
%   preferences = read_preferences() is a struct with a field for each constant, checked.

persistent defaults
if isempty(defaults)
    toolbox = fileparts(fileparts(mfilename('fullpath')));
    defaults = constants_of(fullfile(toolbox, 'kiks_preferences.m'));
end
preferences = defaults;
changes = struct();
file = fullfile(pwd(), 'kiks_preferences.m');
if exist(file, 'file') == 2
    try
        [changes, is_function] = constants_of(file);
    catch failure
        error('kiks:argument', 'kiks_preferences.m in %s must run, but it did not: %s. Mend it or delete it.', ...
            pwd(), regexprep(failure.message, '\.$', ''));
    end
    if is_function
        changes = without_shipped_greys(changes);
    end
end
names = fieldnames(changes);
for k = 1:numel(names)
    if isempty(changes.(names{k}))
        continue  % the default
    elseif isfield(preferences, names{k})
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

function changes = without_shipped_greys(changes)
% The file of KiKS 2.2.0, a function, sets each constant. The user has not chosen greys that are still as shipped.
shipped = greys_of_kiks_2();
names = fieldnames(shipped);
for k = 1:numel(names)
    if isfield(changes, names{k}) && isequal(changes.(names{k}), shipped.(names{k}))
        changes = rmfield(changes, names{k});
    end
end
end

function say_idle(name, value, default)
% Say why a changed constant has no effect.
if isequal(value, default)
    return
end
switch name
    case {'KIKS_SIM_PROX_STEP', 'KIKS_K213_STEP', 'KIKS_MMPERPIXEL'}
        reason = 'the simulator''s rays and movements are exact';
    case {'KIKS_OBJECT_BALL_RADIUS', 'KIKS_ROUNDOBJECT_RADIUS', 'KIKS_SIM_PROX_DIST'}
        reason = 'balls, cylinders and the range of sensors have the sizes of real ones';
    case {'KIKS_K213_2DMODE', 'KIKS_SETTINGS_DIR'}
        reason = 'KiKS 2.2.0 used it for itself';
    case {'KIKS_MOVIE_COMPRESSION', 'KIKS_MOVIE_QUALITY'}
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
check(grey(p.KIKS_COLOR_ROBOT) || whole(p.KIKS_COLOR_ROBOT, -100, -1), 'KIKS_COLOR_ROBOT', p.KIKS_COLOR_ROBOT, ...
    'a grey from 1 to 255, a number of stripes from -1 to -100, or []', '120');
check(whole(p.KIKS_ARENA_DEFAULT_COLOR, 1, 255), 'KIKS_ARENA_DEFAULT_COLOR', p.KIKS_ARENA_DEFAULT_COLOR, ...
    'a grey from 1 to 255', '255');
check(within(p.KIKS_SIM_PROX_NOISE, 100), 'KIKS_SIM_PROX_NOISE', p.KIKS_SIM_PROX_NOISE, ...
    'a share [%] from 0 to 100', '1');
check(within(p.KIKS_SIM_PROX_EMAX, 1), 'KIKS_SIM_PROX_EMAX', p.KIKS_SIM_PROX_EMAX, 'a share from 0 to 1', '0.25');
check(within(p.KIKS_SIM_PROX_EMIN, 1), 'KIKS_SIM_PROX_EMIN', p.KIKS_SIM_PROX_EMIN, 'a share from 0 to 1', '0.10');
check(is_exponent(p.KIKS_SIM_PROX_EEXP), 'KIKS_SIM_PROX_EEXP', p.KIKS_SIM_PROX_EEXP, 'a number above 0', '3');
check(is_exponent(p.KIKS_SIM_LIGHT_FEXP), 'KIKS_SIM_LIGHT_FEXP', p.KIKS_SIM_LIGHT_FEXP, 'a number above 0', '5');
check(within(p.KIKS_K213_NOISE, 100), 'KIKS_K213_NOISE', p.KIKS_K213_NOISE, 'a share [%] from 0 to 100', '10');
check(whole(p.KIKS_TRACE_MAX, 2, 10^6), 'KIKS_TRACE_MAX', p.KIKS_TRACE_MAX, 'a whole number from 2 to 10^6', '8^5');
check(whole(p.KIKS_LOG_HISTORY, 1, 10^6), 'KIKS_LOG_HISTORY', p.KIKS_LOG_HISTORY, ...
    'a whole number from 1 to 10^6', '1000');
end

function yes = is_positive(value)
yes = isnumeric(value) && isscalar(value) && isfinite(value) && value > 0;
end

function yes = is_exponent(value)
yes = isnumeric(value) && isscalar(value) && value > 0;
end

function yes = within(value, high)
yes = isnumeric(value) && isscalar(value) && value >= 0 && value <= high;
end

function check(holds, name, value, what, example)
if ~holds
    error('kiks:argument', '%s must be %s, but it was %s. Write %s = %s; into kiks_preferences.m.', ...
        name, what, shown(value), name, example);
end
end
