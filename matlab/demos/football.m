function football(port, baud, seconds)
% football  Demo: shoot goals.
%
%   football(port, baud, seconds) begins a new world, a pitch with two goals and a ball, and plays for seconds (120)
%   with the robot on port (-1) at baud (9600), to the right. Where ball and robot are it knows from the simulator, as
%   others know it from a camera under the ceiling. After a goal, and when there was none for half a minute, the ball
%   comes to a random place near the middle. It prints each goal and how many there were.
%
%   Example:
%     football(-1, 9600, 300)
%
%   See also kiks_siminfo_objects, kiks_siminfo_robotpos, kiks_arena.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 120;
end
[arena, goal_line] = pitch();
kiks_arena(arena);

ref = kiks_kopen([port baud 1]);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
% Places are complex numbers, real part to the right and imaginary part up: directions are angles then.
middle = complex(size(arena, 2), -size(arena, 1)) / 2;
goal = complex(goal_line(2) + 30, imag(middle));
goals = 0;
last_s = 0;
now_s = kiks_ktime(ref(1));
while now_s < seconds
    ball = kiks_siminfo_objects();
    ball = complex(ball(1, 2), -ball(1, 3));
    pose = kiks_siminfo_robotpos(ref);
    speeds = to_goal(complex(pose(1), -pose(2)), pose(3), ball, goal);
    kSetSpeed(ref, speeds(1), speeds(2));
    kiks_pause(0.04);
    now_s = kiks_ktime(ref(1));
    is_in = real(ball) > goal_line(2);
    if is_in
        goals = goals + 1;
        fprintf('football: goal after %.1f s.\n', now_s);
    end
    if is_in || real(ball) < goal_line(1) || now_s - last_s > 30
        place = middle + complex(200 * rand() - 100, 160 * rand() - 80);
        if kiks_siminfo_setobject(1, real(place), -imag(place), 0, 0)
            last_s = now_s;
        end
    end
end
fprintf('football: %d goals in %.1f s.\n', goals, now_s);
end

function [arena, goal_line] = pitch()
% 700 x 400 mm with goals of 180 mm in recesses of 60 mm, and sloping corners, out of which a ball rolls.
height = 400;
width = 700;
depth = 60;
corner = 80;
arena = zeros(height, width);
[column, row] = meshgrid(1:width, 1:height);
from_end = min(column, width + 1 - column) - depth;
from_side = min(row, height + 1 - row);
arena(from_end + from_side <= corner) = 1;
arena(from_end <= 0) = 1;
arena(round(height / 2) + (-90:90), :) = 0;
arena(round(height / 2), round(width / 2) - 150) = -360;
arena(round(height / 2), round(width / 2)) = 3;
goal_line = [depth width - depth];
end

function speeds = to_goal(place, heading, ball, goal)
% Round the ball until it lies between the robot and the goal, then straight through it.
shot = (goal - ball) / abs(goal - ball);
way = (ball - place) * conj(shot);  % along the shot, and to its left
if real(way) > 40 && abs(imag(way)) < 12 + 0.1 * real(way)
    aim = ball + 40 * shot;
    most = 14;
elseif real(way) > 55
    aim = ball - 75 * shot;
    most = 10;
else
    % The ball is not ahead: past it, on the side on which the robot is, at a distance.
    side = -sign(imag(way) + (imag(way) == 0));
    aim = ball + (-60 + 90i * side) * shot;
    if real(way) < -20 && abs(imag(way)) < 70
        aim = place + (-40i * sign(imag(way) + (imag(way) == 0)) - 20) * shot;
    end
    most = 10;
end
% Not into the walls: the goal is the only way out.
aim = complex(min(max(real(aim), 95), real(goal) + 30), -min(max(-imag(aim), 35), 365));
turn = angle((aim - place) * exp(-1i * heading));
ahead = most * max(0, cos(turn))^2;
spin = max(-8, min(8, 8 * turn));
speeds = ahead + [-1; 1] * spin;
end
