function siminfo(port, baud, seconds)
% siminfo  Demo: let a ball run in circles with what only a simulator can do.
%
%   siminfo(port, baud, seconds) begins a new world, an empty room of 500 x 500 mm with a ball in it. The robot on port
%   (-1) at baud (9600) keeps away from the walls. In each loop the program gives the ball a speed of 100 mm/s and
%   turns its direction by pi/8 rad a second: it runs in circles, and whatever it bounces off, it never stops. Goes on
%   for seconds, until Ctrl-C if they are left out. It prints where the ball is at the end.
%
%   Example:
%     siminfo(-1, 9600, 60)
%
%   See also kiks_siminfo_objects, kiks_siminfo_setobject, avoid.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = Inf;
end
kiks_arena(zeros(500));
kiks_spawn(2, [250 50]);

ref = kiks_kopen([port baud 1]);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
side = 0;
before_s = kiks_ktime(ref(1));
now_s = before_s;
while now_s < seconds
    [speeds, side] = away_from_walls(kProximity(ref), 5, side);
    kSetSpeed(ref, speeds(1), speeds(2));
    light = kAmbient(ref); %#ok<NASGU>
    now_s = kiks_ktime(ref(1));
    ball = kiks_siminfo_objects();
    kiks_siminfo_setobject(1, [], [], 100, ball(1, 5) + pi / 8 * (now_s - before_s));
    before_s = now_s;
end
ball = kiks_siminfo_objects();
fprintf('siminfo: after %.1f s the ball is at (%.0f, %.0f) and runs at %.0f mm/s.\n', now_s, ball(1, 2:4));
end
