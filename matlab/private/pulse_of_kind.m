function mm = pulse_of_kind(robot)
% pulse_of_kind  The way of a wheel for a pulse of its encoder [mm], for a value of KIKS_ROBOT.
%
%   It is [] for a file .toml, which says it.
%
%   Programs for KiKS 2.2.0 count on its pulses: 508 turn the robot by 90 degrees, and a speed of 1 is 8.2 mm/s.

mm = 0.082;
[~, ~, ending] = fileparts(robot);
if strcmpi(ending, '.toml')
    mm = [];
end
end
