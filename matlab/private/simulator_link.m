function [result, link] = simulator_link(what, varargin)
% simulator_link  The way to the simulator's process: two pipes in Octave, a TCP connection in MATLAB.
%
%   link = simulator_link('open', options)              starts the process, or joins one
%   [answer, link] = simulator_link('ask', link, line)  for a connection: sends a line, returns the next answer; ''
%                                                       if the process is gone
%   simulator_link('close', link)                       hangs up; the process ends with the last who does
%
%   MATLAB has no pipes to a process that it has started, so there the process listens. Setting the environment
%   variable KIKS_TRANSPORT to 'tcp' lets Octave do the same.

result = [];
switch what
    case 'open'
        if exist('OCTAVE_VERSION', 'builtin') && ~strcmp(getenv('KIKS_TRANSPORT'), 'tcp')
            result = open_pipes(varargin{1});
        else
            result = open_connection(varargin{1});
        end
    case 'ask'
        [result, link] = ask(varargin{:});
    case 'close'
        hang_up(varargin{1});
end
end

function link = open_pipes(options)
command = kiks_command();
% Octave's `true`, which its help leaves out, makes reading wait until something comes.
[to, from, process] = popen2(command{1}, [command(2:end) {'session'} options], true);
link = struct('is_pipe', true, 'to', to, 'from', from, 'process', process);
% Its first words say that it is there, or why not.
first = fread(from, [1 96], '*char');
if numel(first) == 96
    rest = str2double(first(1:8)) - 88;
    if rest > 0
        first = [first, fread(from, [1 rest], '*char')];
    end
    first = first(9:end);
end
if isempty(door_of(first))
    hang_up(link);
    refuse(first, command);
end
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
link = struct('is_pipe', false, 'to', [], 'from', [], 'name', name, 'port', robot_port('open', name, 9600), 'rest', '');
robot_port('write', link.port, [token 10]);
% Every connection begins with who is there.
[~, link] = ask(link, '');
end

function first = started(command)
% The process writes its first line into a file of ours as soon as it listens.
file = tempname();
line = words_line([command {'session', '--listen', file}]);
if ispc()
    system(['start /B "" ' line]);
else
    system([line ' < /dev/null > /dev/null &']);
end
first = '';
begin = tic();
while isempty(first) && toc(begin) < 60
    pause(0.05);
    if exist(file, 'file')
        first = fileread(file);
        delete(file);
    end
end
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
    error('kiks:session', ['The command kiks must start, but %s did not. Install KiKS (pip install kiks), or set ' ...
        'the environment variable KIKS_COMMAND to where the command is.'], command{1});
end
error('kiks:session', '%s', strtrim(first));
end

function line = words_line(words)
% Quoted, as paths may hold blanks.
line = strjoin(cellfun(@(word) ['"' word '"'], words, 'UniformOutput', false), ' ');
end

function [answer, link] = ask(link, line)
answer = '';
try
    robot_port('write', link.port, line);
    begin = tic();
    while true
        [answer, link.rest] = first_frame(link.rest);
        if ~isempty(answer)
            return
        end
        news = robot_port('read', link.port, 0.5);
        link.rest = [link.rest news];
        % A world that is paused is silent, and so is one that has gone: only the latter lets nobody in.
        if isempty(news) && toc(begin) > 1
            robot_port('close', robot_port('open', link.name, 9600));
            begin = tic();
        end
    end
catch failure
    link.rest = '';
    answer = '';
    if ~strcmp(failure.identifier, 'kiks:link')
        rethrow(failure);
    end
end
end

function [text, rest] = first_frame(rest)
text = '';
if numel(rest) >= 96
    length_ = str2double(rest(1:8));
    whole = max(length_ + 8, 96);
    if numel(rest) >= whole
        text = rest(9:length_ + 8);
        rest = rest(whole + 1:end);
    end
end
end

function hang_up(link)
if ~link.is_pipe
    robot_port('close', link.port);
    return
end
fclose(link.to);
% When it has nobody left it ends, and closes its end: so nothing of it is there when we go on.
while ~isempty(fread(link.from, 64))
end
fclose(link.from);
waitpid(link.process);
end
