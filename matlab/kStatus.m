function kStatus(ref)
% kStatus  Print the state of the motor controllers.
%
%   kStatus(ref) prints, for each wheel of robot ref, whether it is on target, its mode (speed, position or pulse
%   width) and its error [pulses/10 ms, or pulses in position mode]. kGetStatus returns the same as numbers.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kMoveTo(ref, 500, 500);
%     kStatus(ref)
%     kiks_kclose(ref)
%
%   See also kGetStatus.

if nargin < 1
    ref = [];
end
status = kGetStatus(ref);
if numel(status) ~= 6
    fprintf('The robot does not answer.\n');
    return
end
arrivals = {'moving', 'on target'};
modes = {'speed', 'position', 'pulse width'};
sides = {'left', 'right'};
for side = 1:2
    wheel = status(3 * side - 2:3 * side);
    if wheel(2) == 1
        arrival = [arrivals{1 + (wheel(1) ~= 0)} ', '];
    else
        arrival = '';  % the flag means something only in position mode
    end
    if any(wheel(2) == 0:2)
        mode = modes{wheel(2) + 1};
    else
        mode = sprintf('unknown (%d)', wheel(2));
    end
    fprintf('%-5s wheel: %s mode, %serror %d\n', sides{side}, mode, arrival, wheel(3));
end
end
