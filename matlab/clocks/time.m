function seconds = time()
% time  Tell the time since 1970 [s]: the program's, see kiks_clock.

microseconds = kiks_clock('clock');
if ~isempty(microseconds)
    seconds = microseconds / 1e6;
elseif exist('OCTAVE_VERSION', 'builtin')
    seconds = builtin('time');
else
    seconds = posixtime(datetime('now', 'TimeZone', 'local'));
end
end
