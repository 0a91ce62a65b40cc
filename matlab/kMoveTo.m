function result = kMoveTo(ref, left, right)
% kMoveTo  Send the wheels to a position.
%
%   result = kMoveTo(ref, left, right) lets each wheel of robot ref turn until its counter is there [pulses, rounded],
%   with the speed and acceleration of kSetProfile. It does not wait: kGetStatus tells when the wheels have arrived.
%   Returns 0, or -1 if the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetEncoders(ref, 0, 0);
%     kMoveTo(ref, kiks_mm2p(80), kiks_mm2p(80));
%     status = kGetStatus(ref);
%     while status(1) + status(4) < 2, status = kGetStatus(ref); end
%     kiks_kclose(ref)
%
%   See also kSetEncoders, kGetStatus, kSetProfile.

if nargin < 3
    error('kiks:argument', 'kMoveTo needs the positions of both wheels. Give kMoveTo(ref, 1000, 1000).');
end
result = kask(ref, ['C' parameters([left right], 2, 'position [pulses]', 'kMoveTo(ref, 1000, 1000)')], 'c', 0, 1);
end
