function result = kBattle_fire(ref)
% kBattle_fire  Fire the battle turret's gun.
%
%   result = kBattle_fire(ref) fires straight ahead of robot ref, which costs 5 points of energy, and returns [target;
%   distance], 2x1: the number of the robot that was hit, or -1, and the way from the robot's front to what was hit
%   [mm]; [-1; -1] if there was too little energy. -1 if there is no battle turret or it does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     result = kBattle_fire(ref);
%     if result(1) > 0, disp('hit'), end
%     kiks_kclose(ref)
%
%   See also kBattle_sensors.

if nargin < 1
    ref = [];
end
result = kask(ref, 'T,99,F', 't,99,f', 2, 1);
end
