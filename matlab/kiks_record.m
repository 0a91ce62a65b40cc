function kiks_record(file)
% kiks_record  Record the world into a file.
%
%   kiks_record(file) records all that happens in the present world from now on: what programs send and robots answer,
%   how robots move, and what people change. The name must end in .mcap; an existing file is replaced. The recording
%   ends with the world, with the session, and when another one begins. The world is the same with and without it.
%
%   kiks_record('') ends it. Outside of Octave, `kiks replay run.mcap` shows the run again, and `kiks export run.mcap
%   run.mp4` makes a film of it.
%
%   Example:
%     kiks, kiks_record('run.mcap'), ref = kiks_kopen; kSetSpeed(ref, 5, 5), kiks_pause(2), kiks_quit
%
%   See also kiks_recordmovie, kiks_save.

if nargin < 1
    error('kiks:argument', 'kiks_record needs the name of a file. Call kiks_record(''run.mcap'').');
end
file = plain_text(file);
if ~isempty(file)
    ending = '';
    if ischar(file) && size(file, 1) == 1
        [~, ~, ending] = fileparts(file);
    end
    if ~strcmpi(ending, '.mcap')
        error('kiks:argument', 'The file''s name must end in .mcap, but it was %s. Call kiks_record(''run.mcap'').', ...
            shown(file));
    end
    file = absolute_path(file);
end
need_session('kiks_record');
simulator(['record ' escaped(file)]);
end
