function kiks_load(file)
% kiks_load  Begin a new world from a file.
%
%   kiks_load(file) is kiks_arena(file): file is an arena .kad, a picture (.tif .png .bmp .pgm .pbm .ppm), an arena file
%   .toml or a project .kiks. It starts a session if there is none. A project brings its own settings: kiks_preferences
%   does not count in it. The ending may be left out, and files are looked for as kiks does.
%
%   kiks_load lets you choose a file in a dialog. Without a display it lists the arenas that there are.
%
%   Example:
%     kiks, kiks_save('mine.kad'), kiks_load('mine.kad'), kiks_quit
%
%   See also kiks_save, kiks_arena.

need = 'kiks_load needs the name of a file, as text. Call kiks_load(''maze'').';
if nargin < 1
    kinds = {strjoin(strcat('*', arena_endings()), ';'), 'Arenas and projects'};
    file = asked_file(@uigetfile, kinds, 'Load an arena', [need ' ' arenas_there()]);
    if isempty(file)
        return
    end
end
file = plain_text(file);
if ~ischar(file) || isempty(file)
    error('kiks:argument', '%s', need);
end
begin_world(arena_file(file), []);
end
