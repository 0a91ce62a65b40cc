function is = is_octave()
% is_octave  Tell GNU Octave from MATLAB.

persistent answer
if isempty(answer)
    answer = exist('OCTAVE_VERSION', 'builtin') ~= 0;
end
is = answer;
end
