function kiks_spawn(type, place)
% kiks_spawn  Add a light, a ball or a cylinder to the world.
%
%   kiks_spawn(type, [x y]) adds one with its centre at x, y [mm, from 1, x to the right, y down]. type is 1 for a
%   light, 2 for a ball, 3 for a cylinder. If the place is not free, a random one is used.
%
%   kiks_spawn(type) adds a light at a random place, a ball or cylinder in the middle, or, if that is not free, at a
%   random place. It is an error if the place is outside the arena, or if there is no free one.
%
%   Example:
%     kiks(zeros(400)), kiks_spawn(2, [300 300]), kiks_siminfo_objects, kiks_quit
%
%   See also kiks_siminfo_objects, kiks_siminfo_setobject, kiks_checkpoint.

if nargin < 1 || ~isnumeric(type) || ~isscalar(type) || ~any(type == [1 2 3])
    if nargin < 1
        type = [];
    end
    error('kiks:argument', ['The type must be 1 (light), 2 (ball) or 3 (cylinder), but it was %s. ' ...
        'Call kiks_spawn(2).'], shown(type));
end
if nargin < 2 || isempty(place)
    place = [NaN NaN];
elseif ~isnumeric(place) || numel(place) ~= 2 || ~all(isfinite(place))
    error('kiks:argument', ['The place must be two finite numbers [x y] in mm, but it was %s. ' ...
        'Call kiks_spawn(2, [100 200]).'], shown(place));
end
need_session('kiks_spawn');
simulator(sprintf('spawn %d %.17g %.17g', type, place(1), place(2)));
end
