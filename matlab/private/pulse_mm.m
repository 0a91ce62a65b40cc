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
    preferences = read_preferences();
    mm = pulse_of_kind(preferences.KIKS_ROBOT);
end
if isempty(mm)
    mm = pulse_of_file(preferences.KIKS_ROBOT);
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
