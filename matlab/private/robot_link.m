function result = robot_link(what, number, varargin)
% robot_link  The open connections to real robots, by port number.
%
%   opened = robot_link('open', number, name, baud)           [number handle]; number may be [] for the lowest free one
%                                                             from 100 on; handle is another each time
%   reply = robot_link('ask', number, command, timeout)       sends the command and returns the next line without its
%                                                             end; '' if none comes within the timeout [s]
%   robot_link('send', number, command)                       sends it and does not wait
%   text = robot_link('listen', number, silence)              all that arrives until the line is silent that long [s]
%   robot_link('close', number)                               []: all; no error if it is not open
%   seconds = robot_link('time', number)                      since it was opened; [] if it is not open
%   numbers = robot_link('numbers', [])                       the open ports, as a row
%
%   A lost connection is closed and raises an error.

persistent numbers links openings
if isempty(numbers)
    mlock;  % `clear all` in a user's program would lose the open ports
    numbers = zeros(1, 0);
    links = {};
end
result = [];
at = [];
if ~isempty(number)
    at = find(numbers == number, 1);
end
switch what
    case 'numbers'
        result = numbers;
        return
    case 'time'
        if ~isempty(at)
            result = builtin('toc', links{at}.begin);
        end
        return
    case 'close'
        if isempty(number)
            at = 1:numel(numbers);
        end
        closing = links(at);
        links(at) = [];
        numbers(at) = [];
        for link = closing
            robot_port('close', link{1}.port);
        end
        return
    case 'open'
        [name, baud] = varargin{1:2};
        if ~isempty(at) || any(cellfun(@(link) strcmp(link.port.name, name), links))
            error('kiks:link', '%s must be closed before it is opened, but it is open. Call kclose([]) first.', name);
        end
        if isempty(number)
            number = 100;
            while any(numbers == number)
                number = number + 1;
            end
        end
        link = struct('port', robot_port('open', name, baud), 'rest', '', 'owed', 0, 'begin', builtin('tic'));
        % The longest reply has about 270 characters; its duration is an upper bound of any silence within a reply.
        link.patience = 0.05 + 11 * 270 / baud;
        numbers(end + 1) = number;
        links{end + 1} = link;
        openings = sum(openings) + 1;  % the first time it is empty
        result = [number openings];
        return
end
if isempty(at)
    error('kiks:link', ['Port %d must be open, but it is not. Open it with kopen, and use the reference that kopen ' ...
        'returns.'], number);
end
try
    switch what
        case 'ask'
            % A late reply to an earlier command must not answer this one.
            settle(links{at});
            links{at}.rest = '';
            % The reply stays outstanding until it arrives, even if Ctrl-C ends the wait.
            owed = replies_to(varargin{1});
            links{at}.owed = owed;
            robot_port('write', links{at}.port, varargin{1});
            [result, rest] = next_line(links{at}.port, varargin{2});
            if ~ischar(result)
                result = '';
            elseif is_reply_to(varargin{1}, result)
                links{at}.owed = owed - 1;
            end
            links{at}.rest = rest;
        case 'send'
            links{at}.owed = links{at}.owed + replies_to(varargin{1});
            robot_port('write', links{at}.port, varargin{1});
        case 'listen'
            result = links{at}.rest;
            links{at}.rest = '';
            news = robot_port('read', links{at}.port, varargin{1});
            while ~isempty(news)
                result = [result news]; %#ok<AGROW>
                news = robot_port('read', links{at}.port, varargin{1});
            end
            links{at}.owed = 0;
    end
catch failure
    if strcmp(failure.identifier, 'kiks:link')
        link = links{at};
        links(at) = [];
        numbers(at) = [];
        robot_port('close', link.port);
    end
    rethrow(failure);
end
end

function count = replies_to(text)
% One reply for each line that is not empty.
ends = text == 10 | text == 13;
count = sum(ends & ~[true ends(1:end - 1)]);
end

function is = is_reply_to(command, line)
% The power-on banner, for example, is not the reply. Only commands with capitals have a reply of known form.
letter = lower(char(command(1)));
is = letter == command(1) || strncmpi(line, letter, 1) || strncmp(line, 'z,', 2) || strncmp(line, 'Command', 7);
end

function settle(link)
% Read and drop the outstanding replies, until they are complete or the robot is silent.
lines_ = sum(link.rest == 10);
begin = builtin('tic');
while lines_ < link.owed && builtin('toc', begin) < 10 * link.patience
    news = robot_port('read', link.port, link.patience);
    if isempty(news)
        break
    end
    lines_ = lines_ + sum(news == 10);
end
robot_port('read', link.port, 0);
end

function [line, rest] = next_line(port, timeout)
begin = builtin('tic');
line = -1;
rest = '';
left = timeout;
while left >= 0
    rest = [rest robot_port('read', port, left)]; %#ok<AGROW>
    stops = find(rest == 10, 1);
    if ~isempty(stops)
        line = rest(1:stops - 1);
        line = line(line ~= 13);
        rest = rest(stops + 1:end);
        return
    end
    left = timeout - builtin('toc', begin);
end
end
