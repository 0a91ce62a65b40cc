function kiks_recordmovie(name)
% kiks_recordmovie  Not available: KiKS does not record films.
%
%   kiks_recordmovie(name) says so and records nothing, so that old programs run. The simulator's window shows a run
%   while it happens.
%
%   Example:
%     kiks_recordmovie('run')
%
%   See also kiks.

disp('kiks_recordmovie: films are not recorded yet. The simulator''s window shows the run.');
end
