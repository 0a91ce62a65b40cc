function days = now()
% now  Tell the date as a serial number [days]: the program's, see kiks_clock.

days = datenum(clock());
end
