function kiks_load(file)
% kiks_load  Begin a new world from a file.
%
%   kiks_load(file) is kiks_arena(file): file is an arena .kad, a picture (.tif .png .bmp .pgm .pbm .ppm), an arena file
%   .toml or a project .kiks. It starts a session if there is none. A project brings its own settings: kiks_preferences
%   does not count in it.
%
%   Example:
%     kiks, kiks_save('mine.kad'), kiks_load('mine.kad'), kiks_quit
%
%   See also kiks_save, kiks_arena.

file_given = nargin > 0;
if file_given
    file = plain_text(file);
end
if ~file_given || ~ischar(file) || isempty(file)
    error('kiks:argument', 'kiks_load needs the name of a file, as text. Call kiks_load(''arena.kad'').');
end
begin_world(file, []);
end
