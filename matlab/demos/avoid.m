function avoid(port, baud, seconds)
% avoid  Demo: wander about and keep away from the walls.
%
%   avoid(port, baud, seconds) drives for seconds (60) with the robot on port (-1, the simulated one; a real one as in
%   kopen) at baud (9600), in the present world, else in the default arena. In each loop it reads the proximity
%   and the light sensors and sets the speeds. It prints how many loops there were and how far the robot has come.
%
%   Example:
%     avoid(-1, 9600, 20)
%
%   See also follow, kProximity, kAmbient, kSetSpeed.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 60;
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
side = 0;
kSetEncoders(ref, 0, 0);
loops = 0;
brightest = Inf;
now_s = kiks_ktime(ref(1));
while now_s < seconds
    readings = kProximity(ref);
    light = kAmbient(ref);
    if numel(light) == 8
        brightest = min([brightest; light]);
    end
    [speeds, side] = away_from_walls(readings, 5, side);
    kSetSpeed(ref, speeds(1), speeds(2));
    loops = loops + 1;
    now_s = kiks_ktime(ref(1));
end
way = kiks_p2mm(mean(kGetEncoders(ref)));
fprintf('avoid: %.0f mm in %.1f s, %d loops, %.1f a second; the brightest light read %d.\n', way, now_s, loops, ...
    loops / now_s, brightest);
end
