function maze(port, baud, seconds)
% maze  Demo: find the way out of a maze, to the light in its exit.
%
%   maze(port, baud, seconds) drives with the robot on port (-1, the simulated one; a real one as in kopen) at baud
%   (9600) until it is at the light, or until seconds (600) have passed. With a simulated robot it begins a new world, a
%   random maze of 5 x 5 cells; the exit is at the lower right.
%
%   The robot keeps the wall on its left, which leads out of each maze without islands. Once the light is near, it turns
%   towards it. It prints how long that took, and what the brightest sensor reads: about 55 right at the light.
%
%   Example:
%     rand('twister', 7); maze
%
%   See also kiks_generate_maze, follow, kAmbient.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
if nargin < 3 || isempty(seconds)
    seconds = 600;
end
if is_simulated(port)
    kiks_arena(kiks_generate_maze(5, 5));
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
kSetEncoders(ref, 0, 0);
% How much to turn right for the light that each sensor sees.
turns = [-3 -2 -1 1 2 3 4 -4];
[brightest, sensor] = min(kAmbient(ref));
now_s = kiks_ktime(ref(1));
while brightest > 55 && now_s < seconds
    if brightest < 330
        speeds = 3 + [1; -1] * turns(sensor);
    else
        speeds = along_wall(kProximity(ref));
    end
    kSetSpeed(ref, speeds(1), speeds(2));
    light = kAmbient(ref);
    if numel(light) == 8
        [brightest, sensor] = min(light);
    end
    now_s = kiks_ktime(ref(1));
end
kSetSpeed(ref, 0, 0);
way = kiks_p2mm(mean(kGetEncoders(ref)));
if brightest <= 55
    fprintf('maze: at the light after %.1f s and %.0f mm; the brightest sensor reads %d.\n', now_s, way, brightest);
else
    fprintf('maze: not at the light after %.1f s and %.0f mm; the brightest sensor reads %d.\n', now_s, way, brightest);
end
end
