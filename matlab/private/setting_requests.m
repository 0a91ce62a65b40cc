function requests = setting_requests(preferences)
% setting_requests  Turn preferences into requests for the settings of the next world: a row of cells.
%
%   An empty value stands for the simulator's default.

p = preferences;
greys = {p.KIKS_COLOR_BALL, p.KIKS_COLOR_CYLINDER, p.KIKS_COLOR_ROBOT};
if any(strcmpi(p.KIKS_RESPONSE, {'thesis', 'fast', 'standin'}))
    of_the_old = {25, 70, 120};
    is_open = cellfun(@isempty, greys);
    greys(is_open) = of_the_old(is_open);
end
requests = {
    sprintf('set seed %.0f', p.KIKS_SEED)
    ['set thinking ' escaped(thinking(p))]
    ['set robot ' escaped(robot(p.KIKS_ROBOT))]
    ['set response ' escaped(lower(p.KIKS_RESPONSE))]
    sprintf('set noise %d', p.KIKS_NOISE)
    ['set turrets ' escaped(lower(p.KIKS_TURRETS))]
    ['set ball ' number_text(greys{1})]
    ['set cylinder ' number_text(greys{2})]
    ['set brightness ' number_text(greys{3})]
    sprintf('set wall %d', p.KIKS_ARENA_DEFAULT_COLOR)
    ['set robots ' number_text(p.KIKS_ROBOTS)]
    sprintf('set programs %d', p.KIKS_PROGRAMS)
    sprintf('set latency_s %.17g', latency_s(p))
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

function seconds = latency_s(p)
seconds = 0;
if isfield(p, 'is_uncalibrated')
    return  % kiks_calibrate is measuring the line
end
known = calibration();
seconds = max(0, known.KIKS_KSEND_CONSTANT / known.KIKS_CALIBRATE_BAUD);
end
