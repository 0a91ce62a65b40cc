function battle(port, baud, seconds)
% battle  Demo: look for other robots, fire at them and apologize.
%
%   battle(port, baud, seconds) drives with the robot on port (-1, the simulated one; a real one as in kopen) at baud
%   (9600). It needs the turrets battle, K213 and radio. The robot keeps away from the walls. When the camera sees
%   something dark, it turns there and fires, and says sorry by radio to whom it has hit. Goes on for seconds, until
%   Ctrl-C if they are left out.
%
%   Every second it prints where the robot is, where it looks, how far it can see and how much energy it has, and what
%   comes by radio. With a simulated robot it drives in the present world, else in a room with a second robot;
%   another Octave can drive that one: kiks('--join'), battle.
%
%   Example:
%     battle(-1, 9600, 60)
%
%   See also kBattle_sensors, kBattle_fire, kRadio_send, kLinVis.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = Inf;
end
if is_simulated(port) && isempty(kiks_siminfo_robotpos())
    arena = zeros(500, 700);
    arena(250, 150) = -360;
    arena(250, 550) = -180;
    kiks_arena(arena);
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
side = 0;
shots = 0;
hits = 0;
next_s = 0;
now_s = kiks_ktime(ref(1));
while now_s < seconds
    listen(ref);
    readings = kProximity(ref);
    [speeds, side] = away_from_walls(readings, 5, side);
    state = kBattle_sensors(ref);
    off_centre = dark_place(kLinVis(ref));
    if ~isempty(off_centre) && max(readings) < 100
        speeds = speeds + [1; -1] * off_centre / 8;
        if abs(off_centre) < 6 && numel(state) == 7 && state(6) >= 5
            target = fire(ref);
            shots = shots + 1;
            hits = hits + (target > 0);
        end
    end
    kSetSpeed(ref, speeds(1), speeds(2));
    now_s = kiks_ktime(ref(1));
    if numel(state) == 7 && now_s >= next_s
        kiks_print(sprintf('battle: at (%d, %d) mm, angle %d, distance %d mm, energy %d', state([1:4 6])));
        next_s = floor(now_s) + 1;
    end
end
fprintf('battle: %d shots in %.1f s, %d of them hit.\n', shots, now_s, hits);
end

function off_centre = dark_place(pixels)
% Where, right of the middle of the picture, there is something dark [pixels]; [] if there is nothing.
off_centre = [];
if numel(pixels) == 64
    dark = 7 + find(pixels(8:56) < 0.65 * max(pixels(8:56)));
    if numel(dark) >= 4
        off_centre = mean(dark) - 32.5;
    end
end
end

function target = fire(ref)
result = kBattle_fire(ref);
target = result(1);
if target > 0
    kRadio_send(ref, target, 'Terribly sorry!', 15);
end
end

function listen(ref)
status = kRadio_status(ref);
if ~isempty(status) && status(2)
    message = kRadio_read(ref);
    if numel(message) == 18
        kiks_print(sprintf('battle: robot %d says: %s', message(1), char(message(3:2 + message(2))')));
    end
end
end
