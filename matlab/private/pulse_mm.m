function mm = pulse_mm(what)
% pulse_mm  The way of a wheel for a pulse of its encoder [mm].
%
%   mm = pulse_mm()          of this program's robot; without a world, of the robots of the next one
%   mm = pulse_mm('next')    of the robots of the next world; [] if they have a file that says it
%   pulse_mm('forget')       another world may have begun: the session is asked anew

persistent known
if nargin > 0 && strcmp(what, 'forget')
    known = [];
    return
end
mm = known;
if nargin == 0 && isempty(known) && simulator('--is-running', [])
    known = sscanf(simulator('pulse'), '%f', 1);
    mm = known;
end
if nargin > 0 || isempty(mm)
    preferences = read_preferences();
    robot = preferences.KIKS_ROBOT;
    [~, ~, ending] = fileparts(robot);
    if ~strcmpi(ending, '.toml')
        % Programs for KiKS 2.2.0 count on its pulses: 508 turn the robot by 90 degrees.
        mm = 0.082;
    elseif nargin > 0
        mm = [];
    else
        mm = pulse_of_file(robot);
    end
end
end

function mm = pulse_of_file(file)
if exist(absolute_path(file), 'file') ~= 2
    error('kiks:argument', ['KIKS_ROBOT must name a robot''s file that exists, but it was %s. ' ...
        'Look for slips in its name.'], shown(file));
end
number = regexp(fileread(absolute_path(file)), '^\s*pulse_mm\s*=\s*([\d.eE+-]+)', 'tokens', 'once', 'lineanchors');
if isempty(number)
    error('kiks:argument', 'The robot''s file %s must have a line pulse_mm = ..., but it has none.', shown(file));
end
mm = str2double(number{1});
end
