function check_heading(radians)
% check_heading  Reject a heading in degrees: a multiple of 15 beyond one turn. NaN stands for no heading.

if abs(radians) > 2 * pi && mod(radians, 15) == 0
    error('kiks:argument', 'the heading must be in radians, but it was %g. %g degrees are %g * pi / 180.', ...
        radians, radians, radians);
end
end
