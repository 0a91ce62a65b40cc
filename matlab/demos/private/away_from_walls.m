function [speeds, side] = away_from_walls(readings, cruise, side)
% away_from_walls  The speeds that keep a robot away from what its sensors see.
%
%   [speeds, side] = away_from_walls(readings, cruise, side) is [left; right] for the readings of kProximity, both
%   cruise if nothing is near, and [0; 0] if the robot has not answered. side is how it turns: 1 to the left, -1 to the
%   right, 0 not at all. It is passed on from call to call, as changing it in a corner would trap the robot there.

if numel(readings) ~= 8
    speeds = [0; 0];
    return
end
ahead = max(readings(2:5));
if ahead < 100
    side = 0;
elseif side == 0
    side = 1;
    if sum(readings(1:3)) > sum(readings(4:6))
        side = -1;
    end
end
speeds = [cruise; cruise] + [1; -1] * (readings(1) - readings(6)) / 500;
if side ~= 0
    % The nearer, the sharper, up to a turn on the spot.
    inner = cruise * (1 - 2 * min(1, ahead / 500));
    speeds = [cruise; inner];
    if side == 1
        speeds = [inner; cruise];
    end
end
end
