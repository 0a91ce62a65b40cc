function payload = simulator(request, argument)
% simulator  Send a request to the simulator's process; start the process if there is none.
%
%   payload = simulator(request) sends a line and returns the answer. A refusal of the simulator is an Octave
%   error.
%
%   simulator('--join', number)    joins a session that runs on this computer; 0: the newest
%   simulator('--end', [])             leaves the session; no error if there is none
%   simulator('--is-running', [])      true if this Octave or MATLAB has one
%   simulator('--clock', port)     time of a port [s] from the last answer; [] if that was another port's, or
%                                  thinking is measured and it was more than a few milliseconds ago
%
%   Four frames a second announce a slow answer; between two of them Octave handles Ctrl-C. What
%   Ctrl-C left unread is skipped before the next request.

persistent link is_pipe to from line_feed answer answered is_behind ending
if nargin > 1
    payload = [];
    switch request
        case '--clock'
            if ~isempty(answer) && ~is_behind
                told = sscanf(answer(2:20), '%f');
                % A negative number means that thinking is measured: then the time is soon outdated.
                if told(1) == argument || (told(1) == -argument && toc(answered) < 0.005)
                    payload = told(2);
                end
            end
        case '--is-running'
            payload = ~isempty(link);
        case '--join'
            if ~isempty(link)
                error('kiks:session', 'A session must be left before another is joined. Call kiks_quit first.');
            end
            mlock;
            is_pipe = [];
            link = simulator_link('open', {'--join', sprintf('%d', argument)});
            simulator('version');  % a process without a request would end after a timeout
        case '--end'
            if ~isempty(link)
                ending = link;
                link = [];
            end
            answer = '';
            if ~isempty(ending)
                simulator_link('close', ending);
                ending = [];
            end
    end
    return
end
if isempty(link)
    if any(strcmp(strtok(request), {'ask', 'send', 'listen', 'pass', 'pause'}))
        error('kiks:session', 'A port must be open for that, but none is. Open it with ref = kiks_kopen([-1 9600 1]).');
    end
    mlock;  % `clear all` in a user's program would lose the process
    if ~isempty(ending)
        simulator_link('close', ending);  % Ctrl-C has interrupted an earlier close
        ending = [];
    end
    is_pipe = [];
    link = simulator_link('open', {});
end
if isempty(is_pipe)
    to = link.to;
    from = link.from;
    line_feed = char(10);
    is_behind = false;
    is_pipe = link.is_pipe;
end
if is_behind
    link = simulator_link('catch up', link);
end
line = [request line_feed];
is_behind = true;
while true
    if is_pipe
        % Inlined, as programs send thousands of requests a second.
        fputs(to, line);
        fflush(to);
        answer = fread(from, [1 96], '*char');
        if numel(answer) < 96
            break
        end
        length_ = str2double(answer(1:8));
        if length_ > 88
            answer = [answer, fread(from, [1 length_ - 88], '*char')];
        end
        answer = answer(9:length_ + 8);
    else
        [answer, link] = simulator_link('ask', link, line);
        if isempty(answer)
            break
        end
    end
    if answer(1) == '+'
        is_behind = false;
        answered = tic();
        payload = answer(21:end);
        return
    elseif answer(1) == '-'
        is_behind = false;
        answered = tic();
        error('kiks:simulator', '%s', unescaped(answer(21:end)));
    end
    % The answer is not ready; confirm that this program still waits.
    line = line_feed;
end
simulator('--end', []);
error('kiks:session', ['The simulator must answer, but its process has ended. The world is lost: ' ...
    'start another one with kiks(ARENA).']);
end
