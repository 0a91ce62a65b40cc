function mm = kiks_p2mm(p)
% kiks_p2mm  Convert encoder pulses to millimetres.
%
%   mm = kiks_p2mm(p) is how far a wheel has rolled after p pulses of its encoder. p may be a matrix. For how long a
%   pulse is, see kiks_mm2p.
%
%   Example:
%     kiks_p2mm(976)
%
%   See also kiks_mm2p, kGetEncoders.

if nargin < 1 || ~isnumeric(p)
    error('kiks:argument', 'kiks_p2mm needs numbers [pulses]. Give kiks_p2mm(80).');
end
mm = p * pulse_mm();
end
