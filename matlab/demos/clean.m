function clean(port, baud, seconds)
% clean  Demo: push the cylinders that stand about to the walls.
%
%   clean(port, baud, seconds) drives for seconds (60) with the robot on port (-1, the simulated one; a real one as in
%   kopen) at baud (9600). With a simulated robot it begins a new world, an empty room of 500 x 500 mm with twelve
%   cylinders at random places.
%
%   A cylinder fits between the two diagonal sensors, a wall does not. So the robot turns towards whatever it sees and
%   pushes what is in front of it, until that is a wall or moves no more. Then it backs off, turns and looks elsewhere.
%   It prints how often that was, and how many cylinders were and are within 60 mm of a wall.
%
%   Example:
%     clean(-1, 9600, 120)
%
%   See also kGetStatus, kMoveTo, kiks_spawn.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 60;
end
room = 500;
if is_simulated(port)
    kiks_arena(zeros(room));
    for k = 1:12
        kiks_spawn(3, 30 + (room - 60) * rand(1, 2));
    end
    tidy_before = tidy_count(room);
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
kSetProfile(ref, 40, 128, 40, 128);
cruise = 30;
blocked = 0;
turns = 0;
while kiks_ktime(ref(1)) < seconds
    readings = kProximity(ref);
    status = kGetStatus(ref);
    if numel(readings) ~= 8 || numel(status) ~= 6
        continue
    end
    if status(3) + status(6) > cruise
        blocked = blocked + 1;  % both wheels together do not reach half of their speed
    else
        blocked = 0;
    end
    if min(readings([2 5])) > 700 || blocked > 6
        turns = turns + 1;
        blocked = 0;
        turn_away(ref, turns);
    end
    turn = max(-cruise, min(cruise, [-1 -1 -1 1 1 1 0 0] * readings / 100));
    kSetSpeed(ref, cruise + turn, cruise - turn);
end
fprintf('clean: turned back %d times in %.1f s.\n', turns, kiks_ktime(ref(1)));
if is_simulated(port)
    fprintf('clean: %d of 12 cylinders are within 60 mm of a wall; at the start it was %d.\n', tidy_count(room), ...
        tidy_before);
end
end

function turn_away(ref, turns)
% 40 mm back, so that turning does not touch what was brought; then 108 to 252 degrees, each time another angle, as the
% golden section leaves out none for long.
kSetSpeed(ref, 0, 0);
move(ref, -kiks_mm2p(40), -kiks_mm2p(40));
angle = 625 + 830 * mod(0.618 * turns, 1);
move(ref, angle, -angle);
end

function move(ref, left, right)
% A move that is blocked ends as well, after the time that it should have taken.
kSetEncoders(ref, 0, 0);
kMoveTo(ref, left, right);
status = kGetStatus(ref);
while numel(status) == 6 && status(1) + status(4) < 2
    kiks_pause(0.05);
    status = kGetStatus(ref);
end
end

function count = tidy_count(room)
things = kiks_siminfo_objects();
count = sum(min([things(:, 2:3), room + 1 - things(:, 2:3)], [], 2) <= 60);
end
