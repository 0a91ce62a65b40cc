function result = robot_port(what, port, varargin)
% robot_port  Connections to a real robot: TCP, a serial port, or a device file.
%
%   port = robot_port('open', name, baud)       name is 'host:port', with or without socket://, or a serial port
%   robot_port('write', port, text)
%   text = robot_port('read', port, seconds)    what has arrived; waits for the first character at most that long
%   robot_port('close', port)
%
%   A port that cannot be opened, or is lost, raises the error kiks:link. In Octave the package instrument-control does
%   the work. Without it a serial port is read and written as a file, after stty; setting the environment variable
%   KIKS_SERIAL to 'file' chooses that way.

result = '';
try
    switch what
        case 'read'
            result = received(port, varargin{1});
        case 'write'
            transmit(port, uint8(varargin{1}));
        case 'open'
            result = opened(port, varargin{:});
        case 'close'
            % Connections and serial ports close when nothing refers to them any more.
            if strcmp(port.kind, 'file')
                fclose(port.from);
                fclose(port.to);
            end
    end
catch failure
    if strcmp(what, 'close') || ~isempty(strfind(failure.message, 'Interrupted')) %#ok<STREMP>
        return  % Ctrl-C has interrupted the call; the interpreter stops the program itself
    end
    if strcmp(failure.identifier, 'kiks:link')
        rethrow(failure);
    end
    lost(port, regexprep(strtrim(failure.message), '^.*Connection lost.*$', 'the other side has hung up'));
end
end

function port = opened(name, baud)
host = regexp(name, '^(?:socket://|tcp://)?([^:/\\]+):(\d+)$', 'tokens', 'once');
port = struct('kind', 'serial', 'name', name, 'file', name, 'baud', baud, 'from', [], 'to', []);
if ~isempty(host)
    port.kind = 'tcp';
end
has_package = ~is_octave() || has_instrument_control();
try
    if strcmp(port.kind, 'tcp')
        if ~has_package
            error('kiks:link', ['A TCP port needs the package instrument-control, but Octave has none. Install it ' ...
                '(pkg install -forge instrument-control) or open the serial port instead.']);
        end
        if is_octave()
            port.to = tcpclient(host{1}, str2double(host{2}));
        else
            port.to = tcpclient(host{1}, str2double(host{2}), 'ConnectTimeout', 5);
        end
    else
        if is_octave() && isunix() && ~exist(name, 'file')
            error('kiks:link', 'there is no such device');
        end
        if has_package && ~strcmp(getenv('KIKS_SERIAL'), 'file')
            port.to = serialport(name, baud);
            port.to = set_line(port.to);
        else
            port = opened_file(port);
        end
    end
catch failure
    error('kiks:link', ['The robot''s port must open, but %s does not: %s. Give the port of a robot or of kiks ' ...
        'serve: kopen(''/dev/ttyUSB0'', 9600, 1), kopen(''127.0.0.1:10020'').'], name, ...
        regexprep(strtrim(failure.message), '\.$', ''));
end
end

function line = set_line(line)
line.DataBits = 8;
line.Parity = 'none';
line.StopBits = 2;
line.FlowControl = 'none';
if is_octave()
    line.Timeout = 0.1;  % the shortest possible
end
end

function port = opened_file(port)
port.kind = 'file';
if is_octave() && isunix()
    % A symbolic link may change its target when the program that made it restarts.
    port.file = canonicalize_file_name(port.name);
end
[status, text] = system(sprintf('stty -F ''%s'' %d raw -echo min 0 time 0 cs8 cstopb -parenb -crtscts clocal 2>&1', ...
    port.file, port.baud));
if status ~= 0
    error('kiks:link', '%s', strtok(text, char(10)));
end
% Two files, because a single one would read and write through the same buffer.
[port.from, text] = fopen(port.file, 'r');
if port.from < 0
    error('kiks:link', '%s', text);
end
[port.to, text] = fopen(port.file, 'w');
if port.to < 0
    fclose(port.from);
    error('kiks:link', '%s', text);
end
end

function transmit(port, bytes)
if strcmp(port.kind, 'file')
    is_gone = fwrite(port.to, bytes, 'uint8') < numel(bytes) || fflush(port.to) ~= 0;
elseif is_octave()
    is_gone = write(port.to, bytes, 'uint8') < numel(bytes);
else
    write(port.to, bytes, 'uint8');  % raises an error if the connection is lost
    is_gone = false;
end
if is_gone
    lost(port, 'it takes no more');
end
end

function text = received(port, seconds)
if strcmp(port.kind, 'file')
    text = received_file(port, seconds);
    return
end
text = '';
line = port.to;
begin = builtin('tic');
while true
    count = line.NumBytesAvailable;
    if count > 0
        text = char(read(line, double(count), 'uint8'));
        return
    end
    waited = builtin('toc', begin);
    left = seconds - waited;
    if left <= 0
        return
    elseif waited > 0.002
        % At first polling is cheaper than waiting: a robot on this computer answers at once.
        text = wait(port, line, left);
        if ~isempty(text)
            return
        end
    end
end
end

function text = wait(port, line, seconds)
% Wait up to a timeout; may return the first character.
text = '';
if ~is_octave()
    builtin('pause', 0.001);
elseif strcmp(port.kind, 'tcp')
    % This call notices the end of the connection; reading the count does not.
    line.Timeout = min(seconds, 0.5);
    text = char(read(line, 1, 'uint8'));
elseif seconds < 0.1
    builtin('pause', 0.001);
else
    begin = builtin('tic');
    text = char(read(line, 1, 'uint8'));
    if isempty(text) && builtin('toc', begin) < 0.05
        lost(port, 'it has hung up');
    end
end
end

function text = received_file(port, seconds)
begin = builtin('tic');
next_look = 0.2;
while true
    % After reading to the end, the file stays at its end until the end mark is cleared.
    fclear(port.from);
    text = fread(port.from, [1 4096], 'uint8=>char');
    if ~isempty(text)
        return
    end
    waited = builtin('toc', begin);
    if waited >= seconds
        return
    elseif waited > next_look
        next_look = waited + 0.2;
        if ~exist(port.file, 'file')
            lost(port, 'it has gone');
        end
    elseif waited > 0.002
        builtin('pause', 0.001);
    end
end
end

function lost(port, why)
error('kiks:link', ['The connection to the robot at %s must stay, but it is lost: %s. See that the robot, or kiks ' ...
    'serve, runs, and open it again with kopen.'], port.name, why);
end

function has = has_instrument_control()
% Searching for the package is slow, so do it once.
persistent answer
if isempty(answer)
    answer = exist('serialport', 'file') > 0;
    if ~answer && ~isempty(pkg('list', 'instrument-control'))
        pkg('load', 'instrument-control');
        answer = true;
    end
end
has = answer;
end
