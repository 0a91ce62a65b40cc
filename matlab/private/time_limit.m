function [start, seconds] = time_limit(ref, seconds)
% time_limit  Check the duration of a demo ([] for endless), and return its start time by kiks_ktime.

if isempty(seconds)
    seconds = Inf;
elseif ~isnumeric(seconds) || ~isscalar(seconds) || ~(seconds >= 0)
    error('kiks:argument', 'seconds must be a time from 0 on [s], but it was %s. Give 60.', shown(seconds));
end
start = 0;
if seconds < Inf
    start = kiks_ktime(ref(1));
end
end
