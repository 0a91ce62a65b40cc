function figures = robot_figures(name)
% robot_figures  Read a robot definition file of KiKS 2.2.0, a script or a function that sets five constants.
%
%   figures = robot_figures(name) is a row of 19 numbers: the diameter of the body, the distance between the wheels, the
%   range of the proximity sensors [mm], the places of the eight sensors on the rim and their directions [degrees from
%   ahead, left positive]. name is my_robot.m, or my_robot if there is such a file. It is looked for in the current
%   folder and on the path, there also in folders named robots.
%
%   figures is [] if name means another kind of robot.

figures = [];
[folder, base, ending] = fileparts(strrep(name, ' ', '_'));
is_ours = isempty(folder) && any(strcmpi(base, {'khepera', 'khepera_ii'}));
if ~any(strcmpi(ending, {'', '.m'})) || (isempty(ending) && is_ours)
    return
end
folders = {folder};
if isempty(folder)
    folders = [folders, strsplit(path(), pathsep())];
end
file = first_file(folders, {[base '.m'], fullfile('robots', [base '.m'])});
if isempty(file)
    if ~isempty(ending)
        error('kiks:argument', ['KIKS_ROBOT must be a file that exists, but %s is neither in %s nor on the path, ' ...
            'nor in a folder robots there. Look for slips in its name, or give it with its folder.'], ...
            shown(name), pwd());
    end
    return
end
names = {'KIKS_ROBOT_DIAMETER', 'KIKS_ROBOT_DISTANCE_BETWEEN_WHEELS', 'KIKS_PROXIMITY_SENSORS_RANGE', ...
    'KIKS_PROXIMITY_POSITIONS', 'KIKS_PROXIMITY_DIRECTIONS'};
try
    set_ones = constants_of(file);
catch failure
    error('kiks:argument', 'KIKS_ROBOT''s file %s.m must run, but it did not: %s. Mend it, or take another robot.', ...
        base, regexprep(failure.message, '\.$', ''));
end
say_unknown([base '.m'], setdiff(fieldnames(set_ones), names));
values = cell(1, numel(names));
for k = find(isfield(set_ones, names))
    values{k} = set_ones.(names{k});
end
rule = @(k, low, high, what) check_figures([base '.m'], names{k}, values{k}, low, high, what);
rule(1, 10, 500, 'a diameter [mm] from 10 to 500');
rule(2, 1, values{1}, sprintf('a distance [mm] from 1 to the robot''s diameter, %g', values{1}));
rule(3, 10, 500, 'a range [mm] from 10 to 500');
for k = 4:5
    rule(k, -360, 360, 'eight angles [degrees] from -360 to 360, one for each sensor');
end
figures = [values{1:3}, values{4}(:)', values{5}(:)'];
end

function say_unknown(file, unknown)
for k = 1:numel(unknown)
    say_once([file unknown{k}], sprintf('%s: %s has no effect on a robot of this KiKS.', file, unknown{k}));
end
end

function check_figures(file, name, value, low, high, what)
count = 1 + 7 * ~isempty(strfind(name, 'POSITIONS')) + 7 * ~isempty(strfind(name, 'DIRECTIONS'));
if isempty(value)
    error('kiks:argument', '%s must set %s, %s, but it does not. Add it.', file, name, what);
end
is_right = isnumeric(value) && isreal(value) && numel(value) == count && all(value(:) >= low) && all(value(:) <= high);
if ~is_right
    error('kiks:argument', '%s in %s must be %s, but it was %s. Correct it.', name, file, what, shown(value));
end
end
