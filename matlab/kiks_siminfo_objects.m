function list = kiks_siminfo_objects()
% kiks_siminfo_objects  List lights, balls and cylinders.
%
%   list = kiks_siminfo_objects() has a row [type x y speed angle] for each, lights first. type is 1 for a light, 2 for
%   a ball, 3 for a cylinder; x from 1 to the right, y from 1 down [mm]; speed [mm/s]; angle of its motion [rad]. It is
%   0x5 before a session.
%
%   Example:
%     kiks, kiks_spawn(2), kiks_siminfo_objects, kiks_quit
%
%   See also kiks_siminfo_setobject, kiks_spawn.

list = zeros(0, 5);
if is_active()
    payload = simulator('objects');
    if ~isempty(payload)
        list = matrix_of(payload);
    end
end
end
