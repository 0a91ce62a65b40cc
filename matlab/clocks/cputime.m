function [total, user, system_] = cputime()
% cputime  Tell how long the program has computed [s]: as long as it has lived, see kiks_clock.

[total, user, system_] = builtin('cputime');
microseconds = kiks_clock('clock');
if ~isempty(microseconds)
    total = microseconds / 1e6;
    user = total;
    system_ = 0;
end
end
