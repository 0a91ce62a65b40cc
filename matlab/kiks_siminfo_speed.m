function speed = kiks_siminfo_speed()
% kiks_siminfo_speed  Return the speed of the simulation.
%
%   speed = kiks_siminfo_speed() is [average momentary], in percent of real time: since kiks_kopen, and since the last
%   call. After kiks_kclose these are the last figures. It is [100 100] before the first kiks_kopen.
%
%   Example:
%     ref = kiks_kopen; kiks_pause(5), kiks_siminfo_speed, kiks_kclose(ref)
%
%   See also kiks_ktime.

speed = [];
if simulator('--is-running', [])
    speed = sscanf(simulator('pace'), '%f')';
end
if isempty(speed)
    speed = [100 100];
end
end
