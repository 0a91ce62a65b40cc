function p = kiks_mm2p(mm)
% kiks_mm2p  Convert millimetres to encoder pulses.
%
%   p = kiks_mm2p(mm) is how many pulses a wheel's encoder counts while the wheel rolls mm millimetres. It is not
%   rounded; mm may be a matrix.
%
%   A pulse is that of this program's simulated robot: 0.082 mm for the kinds that come with KiKS, else the pulse_mm of
%   the robot's file or project. Before a session it is that of the robots of the next world. For a real robot, measure
%   its pulse (kiks calibrate writes a robot's file) and name the file in KIKS_ROBOT.
%
%   Example:
%     kiks_mm2p(80)
%
%   See also kiks_p2mm, kMoveTo, kiks_preferences.

if nargin < 1 || ~isnumeric(mm)
    error('kiks:argument', 'kiks_mm2p needs numbers [millimetres]. Give kiks_mm2p(80).');
end
p = mm / pulse_mm();
end
