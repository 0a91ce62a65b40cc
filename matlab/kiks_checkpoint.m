function ok = kiks_checkpoint()
% kiks_checkpoint  Remember where robots and things are.
%
%   kiks_checkpoint remembers poses of robots and places of balls, cylinders and lights. kiks_reset puts everything
%   back. Checkpoints are also made when a world begins and after each kiks_spawn. An output, if one is wanted, is 1.
%
%   Example:
%     kiks, kiks_checkpoint, kiks_siminfo_setrobot(100, 300, 0);
%     kiks_reset, kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_reset, kiks_spawn.

need_session('kiks_checkpoint');
simulator('checkpoint');
if nargout > 0
    ok = 1;
end
end
