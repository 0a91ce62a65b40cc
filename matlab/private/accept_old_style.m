function accept_old_style()
% accept_old_style  Keep Octave from warning of what old programs write in each loop: ['N' 10], and if a | b.

if is_octave()
    warning('off', 'Octave:num-to-str');
    warning('off', 'Octave:possible-matlab-short-circuit-operator');
end
end
