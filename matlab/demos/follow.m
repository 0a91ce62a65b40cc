function follow(port, baud, seconds)
% follow  Demo: follow the wall on the left.
%
%   follow(port, baud, seconds) drives for seconds (30) with the robot on port (-1, the simulated one; a real one as in
%   kopen) at baud (9600), in the present world, else in the default arena. Until there is a wall the robot drifts
%   to the left; then it keeps the wall on its left, clockwise round the arena. It prints for how much of the time there
%   was one.
%
%   Example:
%     follow(-1, 9600, 60)
%
%   See also avoid, maze, kProximity.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 30;
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
kSetEncoders(ref, 0, 0);
found_s = Inf;
beside = 0;
loops = 0;
now_s = kiks_ktime(ref(1));
while now_s < seconds
    [speeds, has_wall] = along_wall(kProximity(ref));
    if isinf(found_s) && ~has_wall
        speeds = [5; 7];  % a wide bend, so that a wall will come
    end
    kSetSpeed(ref, speeds(1), speeds(2));
    if has_wall
        found_s = min(found_s, now_s);
        beside = beside + 1;
    end
    loops = loops + ~isinf(found_s);
    now_s = kiks_ktime(ref(1));
end
way = kiks_p2mm(mean(kGetEncoders(ref)));
if isinf(found_s)
    fprintf('follow: %.0f mm in %.1f s, and no wall.\n', way, now_s);
else
    fprintf('follow: %.0f mm in %.1f s, the wall found after %.1f s and there for %.0f %% of the time since.\n', ...
        way, now_s, found_s, 100 * beside / loops);
end
end
