function reply = ksends(varargin)
% ksends  Send a command to a real robot and return its reply, as ksend does.
%
%   reply = ksends(cmd, ref) and ksends(cmd, ref, timeout) are ksend. kMatlab had both, as its ksend did not run in all
%   versions of MATLAB.
%
%   Example:
%     ref = kopen('/dev/ttyUSB0', 9600, 1);
%     ksends(['N' 10], ref)     % n,24,0,0,0,0,0,401,927
%     kclose(ref)
%
%   See also ksend, kcmd.

reply = ksend(varargin{:});
end
