function [speeds, has_wall] = along_wall(readings)
% along_wall  The speeds that keep a robot beside the wall on its left.
%
%   [speeds, has_wall] = along_wall(readings) is [left; right] for the readings of kProximity, and whether a wall is on
%   the left. Without one the robot turns left, as round a corner. [0; 0] if the robot has not answered.

wanted = 400;  % what the left side reads 25 mm from a white wall
has_wall = false;
speeds = [0; 0];
if numel(readings) ~= 8
    return
end
left = max(readings(1:2));
has_wall = left > 60;
% Away from a wall that is too near, towards one that is too far, and hard away from one ahead.
side = max(-2.8, min(5, (left - wanted) / 50));
ahead = (max(0, readings(2) - wanted) + max(readings(3:4))) / 5;
speeds = max(-6, min(9, 5 + [1; -1] * (side + ahead)));
end
