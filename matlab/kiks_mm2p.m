function p = kiks_mm2p(mm)
% kiks_mm2p  Convert millimetres to encoder pulses.
%
%   p = kiks_mm2p(mm) is how many pulses a wheel's encoder counts while the wheel rolls mm millimetres: mm / 0.082.
%   It is not rounded; mm may be a matrix.
%
%   Example:
%     kiks_mm2p(80)
%
%   See also kiks_p2mm, kMoveTo.

if nargin < 1 || ~isnumeric(mm)
    error('kiks:argument', 'kiks_mm2p needs numbers [millimetres]. Give kiks_mm2p(80).');
end
p = mm / 0.082;
end
