function reply = kSetGripper(ref, is_closed)
% kSetGripper  Open or close the jaws of the gripper.
%
%   reply = kSetGripper(ref, is_closed) opens (0) or closes (1) the jaws of the gripper turret of robot ref and returns
%   the reply, 't,1,d'. The jaws take a while to get there. A robot without a gripper replies
%   'z,Turret order not supported'.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetGripper(ref, 1);
%     kiks_kclose(ref)
%
%   See also kSetArm, kTurret.

if nargin < 2
    error('kiks:argument', 'kSetGripper needs 0 to open or 1 to close. Give kSetGripper(ref, 1).');
end
reply = kcmd(ref, ['T,1,D' parameters(double(is_closed), 1, 'jaws (0 open, 1 closed)', 'kSetGripper(ref, 1)')]);
end
