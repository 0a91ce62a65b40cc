function lines = kiks_status(str, dual, replace)
% kiks_status  Write into the log, or read it.
%
%   kiks_status(str) adds text to the log, with the time of day before each line of it; empty lines are left out. The
%   simulator's window shows it, too.
%   kiks_status(str, dual) shows it on the console as well if dual is not 0.
%   kiks_status(str, dual, replace) puts it in the place of the last line if replace is not 0. In the simulator's window
%   it does so if that line is this program's.
%
%   lines = kiks_status() returns the log as a column of cells, the oldest line first: the last 1000
%   (KIKS_LOG_HISTORY in kiks_preferences). kiks_quit empties it.
%
%   Example:
%     kiks_status('half way'); lines = kiks_status()
%
%   See also kiks_print.

persistent history line_limit
if isempty(line_limit)
    history = cell(0, 1);
    preferences = read_preferences();
    line_limit = preferences.KIKS_LOG_HISTORY;
end
if nargin > 0
    str = plain_text(str);
    if ~ischar(str) || size(str, 1) > 1
        error('kiks:argument', 'The text must be a row of characters, but it was %s. Use num2str or sprintf.', ...
            shown(str));
    end
    request = 'print ';
    if nargin > 2 && ~isempty(replace) && any(replace)
        history = history(1:end - 1);
        request = 'print_over ';
    end
    for line_ = regexp(str, '[^\n]+', 'match')
        if nargin > 1 && ~isempty(dual) && any(dual)
            show(line_{1});
        end
        history = [history; {[time_of_day() ' ' line_{1}]}]; %#ok<AGROW>
        if is_active()
            simulator([request escaped(line_{1})]);
        end
        request = 'print ';
    end
    history = history(max(1, end - line_limit + 1):end);
end
if nargout > 0
    lines = history;
end
end

function text = time_of_day()
% The computer's: the log goes on while the world is paused.
if is_octave()
    text = strftime('%H:%M:%S', localtime(builtin('time')));
else
    text = char(datetime('now'), 'HH:mm:ss');
end
end

function show(str)
fprintf('%s\n', str);
if is_octave()
    fflush(stdout);
else
    drawnow;
end
end
