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
%   simulator('--poll', [])            evaluates what people have typed on the desk, and notes that a person is at the
%                                  debugger's prompt
%
%   Four frames a second announce a slow answer; between two of them Octave handles Ctrl-C. What
%   Ctrl-C left unread is skipped before the next request.

persistent link is_ready is_behind to from line_feed answer answered ending stop
if nargin > 1
    payload = [];
    switch request
        case '--clock'
            if ~isempty(answer) && ~is_behind
                told = sscanf(answer(10:28), '%f');
                % A negative number means that thinking is measured: then the time is soon outdated.
                if told(1) == argument || (told(1) == -argument && builtin('toc', answered) < 0.005)
                    payload = told(2);
                end
            end
        case '--poll'
            % While the program is at its prompt: what it knows of the time stays. In MATLAB a timer may come in the
            % middle of a request.
            if ~isempty(link) && (link.is_pipe || ~is_behind)
                kept = {answer, answered};
                if is_octave() && isdebugmode()
                    if isempty(stop)
                        % Octave first calls a hook when no key was pressed for a tenth of a second.
                        stop = max(builtin('toc', answered) - 0.1, 0);
                    end
                    stop = [stop(1), builtin('cputime')];
                    is_ready = false;
                    simulator('poll stands');
                    if isempty(stop)
                        return  % a command typed on the desk has used KiKS, so that there is a later answer
                    end
                    stop(2) = builtin('cputime');
                else
                    has_gone_on = ~isempty(stop);
                    simulator('poll');
                    if has_gone_on
                        return  % from the debugger's prompt to another one: what it has thought was told anew
                    end
                end
                [answer, answered] = kept{:};
            end
        case '--is-running'
            payload = ~isempty(link);
        case '--join'
            if ~isempty(link)
                error('kiks:session', 'A session must be left before another is joined. Call kiks_quit first.');
            end
            mlock;
            is_behind = false;
            link = simulator_link('open', {'--join', sprintf('%d', argument)});
            simulator('version');  % a process without a request would end after a timeout
            session_clocks(true);
        case '--end'
            if ~isempty(link)
                ending = link;
                link = [];
            end
            is_ready = false;
            stop = [];
            answer = '';
            session_clocks(false);
            if ~isempty(ending)
                simulator_link('close', ending);
                ending = [];
            end
    end
    return
end
if is_ready
    % The way of nearly all requests, inlined: programs send thousands a second. Polling is faster than a wait, after
    % which the operating system takes as long to wake a process as the simulator takes to answer.
    is_ready = false;
    is_behind = true;
    fputs(to, [request line_feed]);
    fflush(to);
    answer = fread(from, [1 96], '*char');
    polls = 20;
    while isempty(answer) && polls > 0
        fclear(from);
        answer = fread(from, [1 96], '*char');
        polls = polls - 1;
    end
    if numel(answer) == 96 && answer(9) == '+'
        length_ = str2double(answer(1:8));
        if length_ <= 88
            is_behind = false;
            answered = builtin('tic');
            payload = answer(29:length_ + 8);
            is_ready = true;
            return
        end
    end
else
    if isempty(link)
        mlock;  % `clear all` in a user's program would lose the process
        link = new_link(request, ending);
        ending = [];
        session_clocks(true);
    elseif is_behind
        link = simulator_link('catch up', link);
        is_behind = false;
    end
    if ~isempty(stop) && ~strcmp(request, 'poll stands')
        % A person has been at the debugger's prompt: that was no thinking. From the last look at it on, the processor
        % time of this program tells how long it has thought; the person may have typed meanwhile.
        thought_s = stop(1) + builtin('cputime') - stop(2);
        stop = [];
        simulator(sprintf('stood %.6f', thought_s));
        is_ready = false;
    end
    to = link.to;
    from = link.from;
    line_feed = char(10);
    answer = '';
    is_behind = true;
    simulator_link('send', link, [request line_feed]);
end
while true
    [answer, link] = simulator_link('answer', link, answer);
    if isempty(answer)
        break
    elseif answer(9) ~= '~'
        is_behind = false;
        is_ready = link.is_polled && isempty(stop);
        answered = builtin('tic');
        if answer(9) == '!'
            % A person has typed a command on the desk: it is evaluated first, and then the request is sent again.
            evaluate_typed(unescaped(answer(10:end)), strncmp(request, 'poll', 4));
            if isempty(link)
                error('kiks:session', ['The simulator must run to answer, but a command typed on the desk has ' ...
                    'ended it. Start another one with kiks(ARENA).']);
            end
            payload = simulator(request);
            return
        end
        payload = answer(29:end);
        if answer(9) == '?'
            % An order for a turret of this program. Its function may send requests of its own.
            payload = simulator(own_turrets('call', payload));
        elseif answer(9) ~= '+'
            if answer(9) == '.'
                open_ports('remove', 0);  % Halt was pressed on the desk, which closes them
            end
            error('kiks:simulator', '%s', unescaped(payload));
        end
        return
    end
    % The answer is not ready; confirm that this program still waits.
    answer = '';
    simulator_link('send', link, line_feed);
end
simulator('--end', []);
error('kiks:session', ['The simulator must answer, but its process has ended. The world is lost: ' ...
    'start another one with kiks(ARENA).']);
end

function link = new_link(request, ending)
% A connection to a new process of the simulator.
if any(strcmp(strtok(request), {'ask', 'send', 'listen', 'pass', 'pause'}))
    error('kiks:session', 'A port must be open for that, but none is. Open it with ref = kiks_kopen([-1 9600 1]).');
end
if ~isempty(ending)
    simulator_link('close', ending);  % Ctrl-C has interrupted an earlier close
end
link = simulator_link('open', {});
end
