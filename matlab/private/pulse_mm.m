function mm = pulse_mm(what)
% pulse_mm  The way of a wheel for a pulse of its encoder [mm].
%
%   mm = pulse_mm()       of this program's robot; without a world, of the robots of the next one
%   pulse_mm('forget')    another world may have begun: the session is asked anew

persistent known
if nargin > 0 && strcmp(what, 'forget')
    known = [];
    return
end
if isempty(known) && simulator('--is-running', [])
    known = sscanf(simulator('pulse'), '%f', 1);
end
mm = known;
if isempty(mm)
    robot = next_robot();
    mm = pulse_of_kind(robot);
    if isempty(mm)
        mm = pulse_of_file(robot);
    end
end
end

function robot = next_robot()
% The robot of the next world. Reading all preferences takes milliseconds, and programs convert in loops.
persistent read_robot read_from
file = [];
if exist(fullfile(pwd(), 'kiks_preferences.m'), 'file') == 2
    file = dir('kiks_preferences.m');
end
from = {pwd(), file, global_value('KIKS_ROBOT')};
if isempty(read_robot) || ~isequal(from, read_from)
    preferences = read_preferences();
    read_robot = preferences.KIKS_ROBOT;
    read_from = from;
end
robot = read_robot;
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
