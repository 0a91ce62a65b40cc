function kclose(ref)
% kclose  Close the port of a real robot.
%
%   kclose(ref) closes what kopen has opened; it is no error if it is not open. kclose([]) closes the ports of all real
%   robots. The robot goes on with its last speed. A simulated ref is passed on to kiks_kclose.
%
%   Example:
%     ref = kopen([0 9600 1]);
%     kStop(ref);
%     kclose(ref)
%
%   See also kopen, kiks_kclose.

if nargin < 1
    ref = [];
end
if ~isnumeric(ref)
    error('kiks:argument', 'ref must be what kopen returned, or [] for all, but it was %s. Call kclose(ref).', ...
        shown(ref));
elseif isempty(ref)
    robot_link('close', []);
elseif ref(1) < 0
    kiks_kclose(ref);
else
    robot_link('close', ref(1));
end
end
