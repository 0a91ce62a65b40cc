function requests = setting_requests(preferences)
% setting_requests  Turn preferences into requests for the settings of the next world: a row of cells.
%
%   An empty value stands for the simulator's default.

p = preferences;
figures = robot_figures(p.KIKS_ROBOT);
if ~isempty(figures)
    p.KIKS_ROBOT = 'Khepera';  % with these figures
    if any(strcmpi(p.KIKS_RESPONSE, {'thesis', 'fast'}))
        say_once('KIKS_RESPONSE', sprintf(['KIKS_RESPONSE = ''%s'' has places, directions and a range of its own ' ...
            'for the sensors: those of the robot''s file have no effect.'], p.KIKS_RESPONSE));
    end
end
stripes = 0;
if any(p.KIKS_COLOR_ROBOT < 0)
    stripes = -p.KIKS_COLOR_ROBOT;
    p.KIKS_COLOR_ROBOT = [];
end
greys = {p.KIKS_COLOR_BALL, p.KIKS_COLOR_CYLINDER, p.KIKS_COLOR_ROBOT};
if any(strcmpi(p.KIKS_RESPONSE, {'thesis', 'fast'}))
    of_the_old = struct2cell(greys_of_kiks_2())';
    is_open = cellfun(@isempty, greys);
    greys(is_open) = of_the_old(is_open);
end
pulse = pulse_of_kind(p.KIKS_ROBOT);
dead_band = '';
if ~isempty(pulse)
    % Robots of KiKS 2.2.0 drove exactly as far as they were told. Motors with a dead band stop up to 2 pulses off.
    dead_band = '0';
end
requests = {
    sprintf('set seed %.0f', p.KIKS_SEED)
    ['set thinking ' escaped(thinking(p))]
    ['set robot ' escaped(robot(p.KIKS_ROBOT))]
    ['set pulse_mm ' sprintf('%.17g', pulse)]
    ['set dead_band_pwm ' dead_band]
    ['set response ' escaped(lower(p.KIKS_RESPONSE))]
    sprintf('set noise %d', p.KIKS_NOISE)
    ['set turrets ' escaped(strjoin(built_in_turrets(p.KIKS_TURRETS), ' '))]
    ['set ball ' number_text(greys{1})]
    ['set cylinder ' number_text(greys{2})]
    ['set brightness ' number_text(greys{3})]
    sprintf('set wall %d', p.KIKS_ARENA_DEFAULT_COLOR)
    ['set robots ' number_text(p.KIKS_ROBOTS)]
    sprintf('set programs %d', p.KIKS_PROGRAMS)
    sprintf('set latency_s %.17g', latency_s(p))
    ['set figures ' strtrim(sprintf('%.17g ', figures))]
    sprintf('set stripes %d', stripes)
    sprintf('set noise_percent %.17g', p.KIKS_SIM_PROX_NOISE)
    sprintf('set error_small %.17g', p.KIKS_SIM_PROX_EMAX)
    sprintf('set error_large %.17g', p.KIKS_SIM_PROX_EMIN)
    sprintf('set error_exponent %.17g', min(p.KIKS_SIM_PROX_EEXP, 10^6))
    sprintf('set light_exponent %.17g', min(p.KIKS_SIM_LIGHT_FEXP, 10^6))
    sprintf('set camera_noise_percent %.17g', p.KIKS_K213_NOISE)
    sprintf('set fixed_shutter %d', ~isempty(p.KIKS_K213_NONORMALIZE))
    sprintf('set log_lines %d', p.KIKS_LOG_HISTORY)
    sprintf('set path_points %d', p.KIKS_TRACE_MAX)
    }';
end

function text = number_text(value)
if isempty(value)
    text = '';
else
    text = sprintf('%d', value);
end
end

function text = thinking(p)
persistent measured
text = lower(p.KIKS_THINKING);
if ~isempty(p.KIKS_EMULATED_CPU)
    index = cpu_index(p.KIKS_EMULATED_CPU);
    known = calibration();
    own = known.KIKS_COMPUTER_SPEED;
    if isempty(own)
        if isempty(measured)
            measured = kiks_speedtest();
        end
        own = measured;
    end
    text = sprintf('live:%.6g', index / own);
end
end

function name = robot(name)
[~, ~, ending] = fileparts(name);
if strcmpi(ending, '.toml')
    name = absolute_path(name);
else
    name = strrep(lower(name), ' ', '_');
end
end

function names = built_in_turrets(text)
% A turret of the user's own takes the place of the built-in one with its number.
names = strsplit(strtrim(lower(text)), ' ');
number_of = struct('gripper', 1, 'k213', 2, 'radio', 4, 'battle', 99);
is_replaced = cellfun(@(name) isfield(number_of, name) && any(number_of.(name) == own_turrets('numbers')), names);
for k = find(is_replaced)
    say_once(names{k}, sprintf('A turret of the folder turrets has the number of %s and takes its place.', names{k}));
end
names = names(~is_replaced);
end

function seconds = latency_s(p)
seconds = 0;
if isfield(p, 'is_uncalibrated')
    return  % kiks_calibrate is measuring the line
end
known = calibration();
seconds = max(0, known.KIKS_KSEND_CONSTANT / known.KIKS_CALIBRATE_BAUD);
end
