function dance(port, baud, seconds, partner)
% dance  Demo: two robots dance with each other, each driven by a program of its own.
%
%   In one Octave or MATLAB:      dance
%   then in another one:          kiks('--join'), dance
%
%   The first begins a world with two robots and leads: it tells its partner each figure by radio before it drives it.
%   The second drives what it is told, with left and right exchanged, so that it is the mirror image.
%
%   dance(port, baud, seconds, partner) is for the robot on port (-1; a real one as in kopen) at baud (9600). The dance
%   lasts for seconds (30) from when the partner has answered. partner is the number of the other robot's radio; 0
%   follows the leader. If it is left out, the program that begins the world leads robot 2, and one that joins follows.
%   It prints the number of figures.
%
%   Example:
%     dance
%
%   See also kiks, kRadio_send, kRadio_read, kLED.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 30;
end
is_first = is_simulated(port) && isempty(kiks_siminfo_robotpos());
if nargin < 4 || isempty(partner)
    partner = 2 * is_first;
end
if is_first
    arena = zeros(400, 600);
    arena(200, 200) = -360;  % the first robot is that with the larger number
    arena(200, 400) = -180;
    kiks_arena(arena);
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
if partner > 0
    count = lead(ref, partner, seconds);
    fprintf('dance: led %d figures.\n', count);
else
    [count, leader] = join_in(ref, seconds);
    fprintf('dance: danced %d figures with robot %d.\n', count, leader);
end
end

function count = lead(ref, partner, seconds)
kiks_print('dance: waiting for a partner: kiks(''--join''), dance in another Octave or MATLAB.');
[sender, ~] = heard(ref);
while sender ~= partner
    status = kRadio_status(ref);
    if ~isempty(status) && status(1)
        kRadio_send(ref, partner, hello(), 1);
    end
    builtin('pause', 0.2);  % people are slow: real time, not the robot's
    [sender, ~] = heard(ref);
end
order = [1 2 3 4 5 6 3 4];
count = 0;
start = kiks_ktime(ref(1));
while kiks_ktime(ref(1)) - start < seconds
    count = count + 1;
    figure_now = order(1 + mod(count - 1, numel(order)));
    tell(ref, partner, figure_now);
    step(ref, figure_now, 1);
end
tell(ref, partner, farewell());
end

function [count, leader] = join_in(ref, seconds)
count = 0;
leader = 0;
start = kiks_ktime(ref(1));
while kiks_ktime(ref(1)) - start < seconds + 20
    [sender, word] = heard(ref);
    if word == farewell()
        return
    elseif word == hello()
        leader = sender;
        kRadio_send(ref, leader, hello(), 1);
    elseif word > 0
        leader = sender;
        count = count + 1;
        step(ref, word, 2);
    end
end
end

function step(ref, number, left)
% A figure: forth and back, so that no robot leaves the floor. left is the wheel that plays the left one.
speeds = [6 2; 2 6; 5 -5; -5 5; 6 6; -6 -6];
speeds = speeds(number, [left 3 - left]);
for direction = [1 -1]
    kLED(ref, 0, 2);
    kSetSpeed(ref, direction * speeds(1), direction * speeds(2));
    kiks_pause(0.6);
end
kSetSpeed(ref, 0, 0);
end

function tell(ref, partner, word)
% Again if it got lost, but a partner that has gone ends the dance without a word.
for attempt = 1:5
    kRadio_send(ref, partner, word, 1);
    status = [0 0 0];
    while ~isempty(status) && ~status(1)
        status = kRadio_status(ref);
    end
    if isempty(status) || ~status(3)
        return
    end
end
end

function [sender, word] = heard(ref)
% 0 and 0 if there is nothing new.
sender = 0;
word = 0;
status = kRadio_status(ref);
if ~isempty(status) && status(2)
    message = kRadio_read(ref);
    if numel(message) == 18
        sender = message(1);
        word = message(3);
    end
end
end

function word = hello()
word = 100;
end

function word = farewell()
word = 101;
end
