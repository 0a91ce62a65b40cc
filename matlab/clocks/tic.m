function id = tic()
% tic  Begin to measure the program's time, see kiks_clock; toc ends that.
%
%   id = tic() is for toc(id), and leaves the measurement without a number alone.

if nargout > 0
    microseconds = kiks_clock('clock');
    if isempty(microseconds)
        id = builtin('tic');
    else
        id = uint64(microseconds);
    end
else
    builtin('tic');
    kiks_clock('tic');
end
end
