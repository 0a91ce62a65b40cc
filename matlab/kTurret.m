function reply = kTurret(ref, id, text)
% kTurret  Send an order to a turret.
%
%   reply = kTurret(ref, id, text) sends text to turret number id of robot ref and returns what it answers, without the
%   't,id,' before it; -1 if there is no such turret or it does not know the order. 1 is the gripper, 2 the linear
%   camera, 4 the radio, 99 the battle turret.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kTurret(ref, 2, 'L')      % l,1,200
%     kiks_kclose(ref)
%
%   See also kTurretBios, kLinVis, kSetGripper, kRadio_status, kBattle_sensors.

if nargin < 3 || ~ischar(text)
    error('kiks:argument', 'kTurret needs the turret''s number and the order as a text. Give kTurret(ref, 2, ''L'').');
end
number = parameters(id, 1, 'turret''s number', 'kTurret(ref, 2, ''L'')');
reply = kcmd(ref, ['T' number ',' text]);
head = ['t' number ','];
if strncmp(reply, head, numel(head))
    reply = reply(numel(head) + 1:end);
else
    reply = -1;
end
end
