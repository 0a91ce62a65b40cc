function poll_desk(what)
% poll_desk  Let what people type on the desk reach this program at its prompt, and note when that is the debugger's.
%
%   poll_desk('begin')   asks a few times a second from now on
%   poll_desk('end')     asks no more; no error if it did not
%   poll_desk()          asks once: the hook itself
%
%   Octave calls hooks while it waits for a line to be typed. In MATLAB a timer does it, which is not tested there.

persistent hook
if nargin < 1
    try
        if simulator('--is-running', [])
            simulator('--poll', []);
        else
            poll_desk('end');
        end
    catch failure %#ok<NASGU>
        % A message would come between the letters that a person types; the next function of KiKS fails, too.
    end
    return
end
mlock;  % `clear all` in a user's program would lose the hook
if ~isempty(hook)
    if is_octave()
        remove_input_event_hook(hook);
    else
        stop(hook);
        delete(hook);
    end
    hook = [];
end
if strcmp(what, 'begin')
    if is_octave()
        hook = add_input_event_hook(@poll_desk);
    else
        hook = timer('ExecutionMode', 'fixedSpacing', 'Period', 0.25, 'TimerFcn', @(varargin) poll_desk());
        start(hook);
    end
end
end
