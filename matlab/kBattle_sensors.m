function values = kBattle_sensors(ref)
% kBattle_sensors  Read the sensors of the battle turret: place, compass, distance, energy.
%
%   values = kBattle_sensors(ref) returns, 7x1, for robot ref: x and y [mm from the left and the top], heading [degrees,
%   0..359, 0 is right, 90 up], free way ahead [mm], energy [percent], energy [points], and hits since last asked. -1 if
%   there is no battle turret or it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     values = kBattle_sensors(ref);
%     fprintf('at (%d, %d) mm, heading %d degrees\n', values(1:3));
%     kiks_kclose(ref)
%
%   See also kBattle_fire.

if nargin < 1
    ref = [];
end
values = kask(ref, 'T,99,S', 't,99,s', 7, 1);
end
