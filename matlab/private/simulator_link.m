function [result, link] = simulator_link(what, varargin)
% simulator_link  The connection to the simulator's process: two pipes in Octave, TCP in MATLAB.
%
%   link = simulator_link('open', options)              starts the process, or joins one
%   simulator_link('send', link, line)                  sends a line
%   [answer, link] = simulator_link('answer', link, begin)
%                                                       waits for the next frame and returns it without the blanks at
%                                                       its end; '' if the process is gone. begin: what was read of it
%   link = simulator_link('catch up', link)             cancels the request that Ctrl-C has interrupted, and skips
%                                                       its answer
%   simulator_link('close', link)                       closes it; the process ends with its last connection
%
%   MATLAB has no pipes to a process that it has started, so there the process listens. Setting the environment
%   variable KIKS_TRANSPORT to 'tcp' lets Octave do the same.

result = [];
switch what
    case 'open'
        if ~isempty(getenv('KIKS_PIPES'))
            result = open_given(sscanf(getenv('KIKS_PIPES'), '%d'));
        elseif exist('OCTAVE_VERSION', 'builtin') && ~strcmp(getenv('KIKS_TRANSPORT'), 'tcp')
            result = open_pipes(varargin{1});
        else
            result = open_connection(varargin{1});
        end
    case 'send'
        send(varargin{:});
    case 'answer'
        [result, link] = next_frame(varargin{:});
    case 'catch up'
        result = caught_up(varargin{1});
    case 'close'
        hang_up(varargin{1});
end
end

function link = open_pipes(options)
persistent unfinished
if ~isempty(unfinished)
    % Ctrl-C has interrupted the start of another process.
    forgotten = unfinished;
    unfinished = [];
    hang_up(forgotten);
end
command = kiks_command();
% The argument `true`, which Octave's help does not mention, makes reads wait for data.
[to, from, process] = popen2(command{1}, [command(2:end) {'session'} options], true);
link = struct('is_pipe', true, 'is_polled', nproc() > 1, 'to', to, 'from', from, 'process', process, ...
    'is_joined', ~isempty(options));
unfinished = link;
% The first answer is the greeting or an error; frames that announce it may precede it.
while true
    first = next_frame(link, '');
    if numel(first) < 9 || first(9) ~= '~'
        break
    end
    send(link, char(10));
end
first = first(9:end);
if isempty(door_of(first))
    hang_up(link);
    unfinished = [];
    refuse(first, command);
end
unfinished = [];
end

function link = open_given(pipes)
% KiKS has started this Octave itself, and answers at the other ends of these two pipes.
link = struct('is_pipe', true, 'is_polled', nproc() > 1, 'to', fopen(sprintf('/dev/fd/%d', pipes(2)), 'w'), ...
    'from', fopen(sprintf('/dev/fd/%d', pipes(1)), 'r'), 'process', [], 'is_joined', true);
end

function link = open_connection(options)
command = kiks_command();
if isempty(options)
    first = started(command);
else
    [~, first] = system(words_line([command {'session', '--where'} options(2:end)]));
end
[number, token] = door_of(first);
if isempty(number)
    refuse(first, command);
end
name = sprintf('127.0.0.1:%d', number);
link = struct('is_pipe', false, 'is_polled', false, 'to', [], 'from', [], ...
    'port', robot_port('open', name, 9600), 'rest', '');
robot_port('write', link.port, [token 10]);
% Every connection begins with the greeting.
[~, link] = next_frame(link, '');
end

function first = started(command)
% The process writes its first line into our file as soon as it listens. The folder is new, so that no other user can
% put another file there.
folder = tempname();
[is_made, why] = mkdir(folder);
if ~is_made || ~isempty(why)
    error('kiks:session', 'A folder %s must be made for the session''s file, but it was not: %s.', folder, why);
end
file = fullfile(folder, 'session');
line = words_line([command {'session', '--listen', file}]);
if ispc()
    system(['start /B "" ' line]);
else
    system([line ' < /dev/null > /dev/null &']);
end
first = '';
begin = builtin('tic');
while isempty(first) && builtin('toc', begin) < 60
    builtin('pause', 0.05);
    if exist(file, 'file')
        first = fileread(file);
        delete(file);
    end
end
rmdir(folder);
end

function [number, token] = door_of(first)
% 'KiKS 3.0.0 session 4711 port 40123 token xyz'
number = [];
token = '';
if ischar(first)
    words = strsplit(strtrim(first), ' ');
    if numel(words) == 8 && strcmp(words{1}, 'KiKS')
        number = str2double(words{6});
        token = words{8};
    end
end
end

function refuse(first, command)
if ~ischar(first) || isempty(strtrim(first))
    error('kiks:session', ['The command kiks must start, but %s did not. Install KiKS (pip install . in a ' ...
        'checkout), or tell where the command is: setenv(''KIKS_COMMAND'', ''/home/me/KiKS/.venv/bin/kiks'').'], ...
        command{1});
end
error('kiks:session', '%s', strtrim(first));
end

function line = words_line(words)
% Quoted, as paths may hold blanks.
line = strjoin(cellfun(@(word) ['"' word '"'], words, 'UniformOutput', false), ' ');
end

function send(link, line)
if link.is_pipe
    fputs(link.to, line);
    fflush(link.to);
    return
end
try
    robot_port('write', link.port, line);
catch failure
    ignore_lost(failure);  % waiting for the answer detects the end of the process
end
end

function [answer, link] = next_frame(link, answer)
if link.is_pipe
    let_reads_wait(link, true);
    for ending = [96 0]
        if ending == 0
            ending = frame_length(answer);
        end
        if numel(answer) < ending
            answer = [answer, fread(link.from, [1 ending - numel(answer)], '*char')];
        end
        if numel(answer) < ending
            answer = '';
            return
        end
    end
    answer = answer(1:frame_length(answer));
    let_reads_wait(link, ~link.is_polled);
    return
end
answer = '';
silence = builtin('tic');
try
    while isempty(answer)
        [answer, link.rest] = first_frame(link.rest);
        if isempty(answer)
            news = robot_port('read', link.port, 0.5);
            link.rest = [link.rest news];
            if ~isempty(news)
                silence = builtin('tic');
            elseif builtin('toc', silence) > 60
                % Even during a slow answer, four frames a second arrive.
                return
            end
        end
    end
catch failure
    link.rest = '';
    answer = '';
    ignore_lost(failure);
end
end

function length_ = frame_length(frame)
% Without the blanks that fill it up.
length_ = str2double(frame(1:8)) + 8;
end

function let_reads_wait(link, is_waiting)
% Whether a read of the pipe waits for data, or returns at once.
fclear(link.from);
if is_waiting
    fcntl(link.from, F_SETFL(), 0);
else
    fcntl(link.from, F_SETFL(), O_NONBLOCK());
end
end

function ignore_lost(failure)
if ~strcmp(failure.identifier, 'kiks:link')
    rethrow(failure);
end
end

function link = caught_up(link)
% The answer to char(24) and a character is many times char(1), then a single char(2) and
% that character, which changes each time, as Ctrl-C may interrupt this exchange, too.
persistent number
number = mod(sum(number), 94) + 1;
sign = char(32 + number);
ending = char([2 sign]);
line = char([24 sign 10]);
if link.is_pipe
    let_reads_wait(link, true);
    send(link, line);
    count = 96;
    last = '';
    news = 'x';
    while ~isempty(news) && ~strcmp(last, ending)
        news = fread(link.from, [1 count], '*char');
        if any(news == 1)
            count = 1;
        end
        last = [last news];
        last = last(max(1, end - 1):end);
    end
    return
end
try
    robot_port('write', link.port, line);
    link.rest = '';
    silence = builtin('tic');
    while isempty(strfind(link.rest, ending)) && builtin('toc', silence) < 60 %#ok<STREMP>
        news = robot_port('read', link.port, 0.5);
        if ~isempty(news)
            silence = builtin('tic');
        end
        link.rest = [link.rest(max(1, end):end) news];
    end
    link.rest = link.rest(strfind(link.rest, ending) + 2:end);
catch failure
    ignore_lost(failure);  % the next request detects the end of the process
end
end

function [text, rest] = first_frame(rest)
text = '';
if numel(rest) >= 96
    length_ = str2double(rest(1:8));
    whole = max(length_ + 8, 96);
    if numel(rest) >= whole
        text = rest(1:length_ + 8);
        rest = rest(whole + 1:end);
    end
end
end

function hang_up(link)
if ~link.is_pipe
    try
        robot_port('write', link.port, char([4 10]));
    catch
        % The process has already ended.
    end
    robot_port('close', link.port);
    return
end
let_reads_wait(link, true);
if isempty(link.process)
    send(link, ['close 0' char(10)]);
    next_frame(link, '');
    fclose(link.to);
    fclose(link.from);
    return
end
% Send an explicit end, as other processes that Octave has started may keep the pipe open.
try
    fputs(link.to, char([4 10]));
    fclose(link.to);
catch
    % Ctrl-C has interrupted this function.
end
% After its last client has left, the process ends and closes the pipe; wait for that.
last = '';
news = 'x';
while ~isempty(news)
    news = fread(link.from, [1 64], '*char');
    last = [last(max(1, end - 95):end) news];
end
fclose(link.from);
% If the session goes on for other programs, the last frame says so.
if link.is_joined || numel(last) < 96 || last(end - 87) ~= '>'
    waitpid(link.process);
end
end
