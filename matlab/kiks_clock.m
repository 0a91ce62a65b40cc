function answer = kiks_clock(what, seconds)
% kiks_clock  Ask for the time of this program: what tic, toc, time, clock, now, cputime and pause of a session do.
%
%   kiks_clock('clock')         is the time since 1970 [us]. While a simulated port is open, it goes on with simulated
%                               time, else with the computer's. It never jumps
%   kiks_clock('tic')           begins to measure
%   kiks_clock('toc')           is the time since then [us]
%   kiks_clock('rest', seconds) pauses; it is 1 if the program must pause in real time instead, else 0
%
%   It is [] if the computer's own clock counts: without a session, and while a real robot is open.
%
%   Example:
%     ref = kiks_kopen; t = kiks_clock('clock'); kiks_pause(2), kiks_clock('clock') - t, kiks_kclose(ref)
%
%   See also kiks_ktime, kiks_pause.

if nargin < 1
    what = [];
end
if ~any(strcmp(what, {'clock', 'tic', 'toc', 'rest'}))
    error('kiks:argument', ['The question must be clock, tic, toc or rest, but it was %s. ' ...
        'Call kiks_clock(''clock'').'], shown(what));
end
answer = [];
if simulator('--is-running', []) && isempty(robot_link('numbers', []))
    if nargin > 1
        what = sprintf('%s %.17g', what, seconds);
    end
    answer = sscanf(simulator(what), '%f', 1);
end
end
