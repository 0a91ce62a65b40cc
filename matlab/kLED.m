function result = kLED(ref, led, action)
% kLED  Switch the lights on the robot.
%
%   result = kLED(ref, led, action) switches a light of robot ref: led is 0 (at the side) or 1 (in front), action 0 off,
%   1 on, 2 toggle. Both may be vectors, for several lights one after the other; a single action holds for all of them.
%   Returns the actions, with -1 for each that the robot did not confirm.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kLED(ref, 0, 1);          % light 0 on
%     kLED(ref, [0 1], 2);      % toggle both
%     kiks_kclose(ref)
%
%   See also kcmd.

if nargin < 3 || ~isnumeric(led) || ~isnumeric(action) || ...
        (numel(action) ~= 1 && numel(action) ~= numel(led) && numel(led) ~= 1)
    error('kiks:argument', ['kLED needs lights and actions, as many of the one as of the other, or one action. ' ...
        'Give kLED(ref, 0, 1) or kLED(ref, [0 1], 2).']);
end
if isscalar(action)
    action = repmat(action, size(led));
elseif isscalar(led)
    led = repmat(led, size(action));
end
result = action;
for at = 1:numel(led)
    order = parameters([led(at) action(at)], 2, 'light and action', 'kLED(ref, 0, 1)');
    if kask(ref, ['L' order], 'l', 0, 1) ~= 0
        result(at) = -1;
    end
end
end
