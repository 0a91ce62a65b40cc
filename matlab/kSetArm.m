function reply = kSetArm(ref, position)
% kSetArm  Move the arm of the gripper.
%
%   reply = kSetArm(ref, position) moves the arm of the gripper turret of robot ref to a position [255 down in front,
%   127 upright, 0 folded back; rounded] and returns the reply, 't,1,e'. The arm takes a while to get there. A robot
%   without a gripper replies 'z,Turret order not supported'.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kSetArm(ref, 255);
%     kiks_pause(1);
%     kSetGripper(ref, 1);
%     kiks_kclose(ref)
%
%   See also kSetGripper, kTurret.

if nargin < 2
    error('kiks:argument', 'kSetArm needs the position. Give kSetArm(ref, 255).');
end
reply = kcmd(ref, ['T,1,E' parameters(position, 1, 'position [0..255]', 'kSetArm(ref, 255)')]);
end
