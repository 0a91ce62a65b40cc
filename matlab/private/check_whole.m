function check_whole(name, value, low, high, advice)
% check_whole  Stop with a message if a value is not a whole number from low to high.

if ~isnumeric(value) || ~isscalar(value) || ~(value >= low && value <= high) || value ~= fix(value)
    error('kiks:argument', '%s must be a whole number from %.0f to %.0f, but it was %s. %s', name, low, high, ...
        shown(value), advice);
end
end
