function braitenberg_step(ref, factor)
% braitenberg_step  Let a robot avoid obstacles for one exchange: each sensor slows one wheel and speeds the other.
%
%   braitenberg_step(ref, factor) sets the speeds of the wheels to factor * (20 + weighted readings).

persistent gains
if isempty(gains)
    gains = [4 4 6 -18 -15 -5 5 3; -5 -15 -18 6 4 4 3 5] / 400;
end
readings = kProximity(ref);
if numel(readings) ~= 8
    error('kiks:link', ['The robot must answer, but it was silent three times. See that it is switched on and that ' ...
        'its baud rate is the one that the port was opened with.']);
end
speeds = factor * (20 + gains * readings);
kSetSpeed(ref, speeds(1), speeds(2));
end
