function versions = kTurretBios(ref, id)
% kTurretBios  Ask for the version of a turret.
%
%   versions = kTurretBios(ref, id) prints and returns [version; revision], 2x1, of turret number id of robot ref; -1 if
%   there is no such turret.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kTurretBios(ref, 2);
%     kiks_kclose(ref)
%
%   See also kTurret, kBios.

if nargin < 2
    error('kiks:argument', 'kTurretBios needs the turret''s number. Give kTurretBios(ref, 2).');
end
number = parameters(id, 1, 'turret''s number', 'kTurretBios(ref, 2)');
versions = kask(ref, ['T' number ',B'], ['t' number ',b'], 2, 1);
if numel(versions) == 2
    fprintf('Turret %s: version %d, revision %d\n', number(2:end), versions);
else
    fprintf('Turret %s does not answer.\n', number(2:end));
end
end
