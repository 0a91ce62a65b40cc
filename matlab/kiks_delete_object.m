function kiks_delete_object(rows)
% kiks_delete_object  Take lights, balls or cylinders out of the world.
%
%   kiks_delete_object(rows) takes away the things in these rows of kiks_siminfo_objects: a number or a vector. Those
%   below them move up. kiks_reset does not bring them back.
%
%   Example:
%     kiks, kiks_spawn(2), kiks_spawn(1)
%     list = kiks_siminfo_objects(); kiks_delete_object(find(list(:, 1) == 2)), kiks_siminfo_objects, kiks_quit
%
%   See also kiks_spawn, kiks_siminfo_objects.

if nargin < 1 || ~isnumeric(rows) || ~all(rows(:) >= 1 & rows(:) < Inf & rows(:) == fix(rows(:)))
    if nargin < 1
        rows = [];
    end
    error('kiks:argument', ['The rows must be those of things in kiks_siminfo_objects, from 1 on, but they were ' ...
        '%s. Call kiks_delete_object(1).'], shown(rows));
end
need_session('kiks_delete_object');
simulator(['delete' sprintf(' %d', rows)]);
end
