function parts = clock()
% clock  Tell the date as year, month, day, hour, minute and seconds: the program's, see kiks_clock.

if exist('OCTAVE_VERSION', 'builtin')
    now_ = localtime(time());
    parts = [now_.year + 1900, now_.mon + 1, now_.mday, now_.hour, now_.min, now_.sec + now_.usec / 1e6];
else
    parts = datevec(datetime(time(), 'ConvertFrom', 'posixtime', 'TimeZone', 'local'));
end
end
