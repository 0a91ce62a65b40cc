function allow_numbers_in_text()
% allow_numbers_in_text  Keep Octave from warning of ['N' 10], as programs for Kheperas write all their commands.

if is_octave()
    warning('off', 'Octave:num-to-str');
end
end
