function result = kSetProfile(ref, speed_left, acceleration_left, speed_right, acceleration_right)
% kSetProfile  Set how fast kMoveTo moves.
%
%   result = kSetProfile(ref, speed_left, acceleration_left, speed_right, acceleration_right) sets the greatest speeds
%   [pulses/10 ms, 1..127] and the accelerations [pulses/256 per 10 ms and 10 ms, 1..255; 64 is about 200 mm/s^2] of
%   the wheels of robot ref. What is left out, or [], is as after the power-on: 20, 64, 20, 64. Returns 0, or -1 if
%   the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetProfile(ref, 40, 96, 40, 96);
%     kMoveTo(ref, 1000, 1000);
%     kiks_kclose(ref)
%
%   See also kMoveTo, kGetStatus.

if nargin < 1
    ref = [];
end
if nargin < 2 || isempty(speed_left)
    speed_left = 20;
end
if nargin < 3 || isempty(acceleration_left)
    acceleration_left = 64;
end
if nargin < 4 || isempty(speed_right)
    speed_right = 20;
end
if nargin < 5 || isempty(acceleration_right)
    acceleration_right = 64;
end
profile = parameters([speed_left acceleration_left speed_right acceleration_right], 4, ...
    'profile [pulses/10 ms, pulses/256 per (10 ms)^2]', 'kSetProfile(ref, 20, 64, 20, 64)');
result = kask(ref, ['J' profile], 'j', 0, 1);
end
