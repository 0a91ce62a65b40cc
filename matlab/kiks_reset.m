function ok = kiks_reset(~)
% kiks_reset  Move robots and things back to where they were at the last checkpoint.
%
%   kiks_reset moves everything back. Time, open ports and the wheels' speeds go on. An argument has no effect, as in
%   KiKS 2.2.0; an output, if one is wanted, is 1.
%
%   Example:
%     kiks, kiks_siminfo_setrobot(100, 300, 0); kiks_reset, kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_checkpoint.

need_session('kiks_reset');
simulator('reset');
if nargout > 0
    ok = 1;
end
end
