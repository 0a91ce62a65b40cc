function camera(port, baud, seconds)
% camera  Demo: wander about and take pictures with the linear camera.
%
%   camera(port, baud, seconds) drives for seconds (60) with the robot on port (-1, the simulated one; a real one as in
%   kopen) at baud (19200, so that a picture takes 150 ms) and keeps away from the walls. It needs the turret K213. With
%   a simulated robot it drives in the present world, else in a room with bands of different grey on its walls.
%
%   Every 5 s it prints the picture as a line of characters, heavy ones for dark pixels, and at the end how many
%   pictures there were.
%
%   Example:
%     camera(-1, 19200, 30)
%
%   See also kLinVis, avoid.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 19200;
end
if nargin < 3 || isempty(seconds)
    seconds = 60;
end
if is_simulated(port) && isempty(kiks_siminfo_robotpos())
    room = banded_room();
    kiks_arena(room{:});
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>
side = 0;
shades = '#%*+=-:. ';
pictures = 0;
darkest = Inf;
brightest = -Inf;
next_s = 0;
now_s = kiks_ktime(ref(1));
while now_s < seconds
    [speeds, side] = away_from_walls(kProximity(ref), 3, side);
    kSetSpeed(ref, speeds(1), speeds(2));
    pixels = kLinVis(ref);
    if numel(pixels) == 64
        pictures = pictures + 1;
        darkest = min([darkest; pixels]);
        brightest = max([brightest; pixels]);
        if now_s >= next_s
            fprintf('camera: %5.1f s [%s]\n', now_s, shades(1 + floor(pixels' / 256 * numel(shades))));
            next_s = next_s + 5;
        end
    end
    now_s = kiks_ktime(ref(1));
end
if pictures == 0
    fprintf('camera: the robot has no camera that answers.\n');
else
    fprintf('camera: %d pictures in %.1f s, with greys from %d to %d.\n', pictures, now_s, darkest, brightest);
end
end

function world = banded_room()
% {arena, colormask}: walls of 10 mm round 500 x 500 mm, in bands of 40 mm.
[arena, colormask] = kiks_arena_new_create(500, 500);
greys = [60 255 130 255 1 255];
bands = greys(1 + mod(floor((0:499) / 40), numel(greys)));
across = repmat(bands, 500, 1);
along = across';
colormask([1:10 491:500], :) = across([1:10 491:500], :);
colormask(:, [1:10 491:500]) = along(:, [1:10 491:500]);
world = {double(arena), colormask};
end
