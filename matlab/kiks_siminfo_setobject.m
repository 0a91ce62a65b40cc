function ok = kiks_siminfo_setobject(row, x, y, spd, ang)
% kiks_siminfo_setobject  Move a light, ball or cylinder, or make it roll.
%
%   ok = kiks_siminfo_setobject(row, x, y, spd, ang) moves the thing in that row of kiks_siminfo_objects to x, y [mm]
%   and gives it the speed spd [mm/s] in the direction ang [rad]. [] or a missing argument keeps a value. ok is 1; it
%   is 0 if the place is not free: then it stays where it is but gets speed and angle. It is 0 before a session.
%
%   Example:
%     kiks, kiks_spawn(2), kiks_siminfo_setobject(1, [], [], 100, pi / 2), kiks_siminfo_objects, kiks_quit
%
%   See also kiks_siminfo_objects, kiks_spawn.

if nargin < 1 || ~isnumeric(row) || ~isscalar(row) || ~(row >= 1 && row < Inf) || row ~= fix(row)
    if nargin < 1
        row = [];
    end
    error('kiks:argument', ['The row must be that of a thing in kiks_siminfo_objects, from 1 on, but it was %s. ' ...
        'Call kiks_siminfo_setobject(1, 100, 200).'], shown(row));
end
values = NaN(1, 4);
if nargin > 1
    values(1) = kept('x', x);
end
if nargin > 2
    values(2) = kept('y', y);
end
if nargin > 3
    values(3) = kept('The speed', spd);
end
if nargin > 4
    values(4) = kept('The angle', ang);
    check_heading(values(4));
end
ok = 0;
if is_active()
    ok = str2double(simulator(sprintf('set_object %d%s', row, sprintf(' %.17g', values))));
end
end

function value = kept(name, value)
if isempty(value)
    value = NaN;
elseif ~isnumeric(value) || ~isscalar(value) || isinf(value)
    error('kiks:argument', ['%s must be a finite number, or [] to keep it, but it was %s. ' ...
        'See help kiks_siminfo_setobject.'], name, shown(value));
end
end
