function [arena, colormask] = kiks_tif2arena(file)
% kiks_tif2arena  Read an arena's picture.
%
%   [arena, colormask] = kiks_tif2arena(file) reads a picture (.tif .png .bmp .pgm .pbm .ppm), or the walls of a .kad,
%   .toml or .kiks, at 1 mm per pixel. Black is floor, any other grey a wall of that grey. arena is logical, true where
%   there is wall; colormask is uint8, its greys. Start poses and things can be written into arena after
%   arena = double(arena). If the file cannot be read, there is a warning and both are empty.
%
%   Example:
%     kiks, kiks_save('mine.kad'), [arena, colormask] = kiks_tif2arena('mine.kad'); size(arena)
%     kiks_arena(arena, colormask), kiks_quit
%
%   See also kiks_arena, kiks_kad2arena.

if nargin < 1
    file = '';
end
file = plain_text(file);
arena = [];
colormask = [];
try
    if ~ischar(file) || isempty(file)
        error('kiks:argument', ['The name of the file must be text, but it was %s. ' ...
            'Call kiks_tif2arena(''arena.tif'').'], shown(file));
    end
    path_name = arena_file(file);
    prepare_process();
    greys = matrix_of(simulator(['read ' escaped(path_name)]));
catch failure
    warn('kiks:file', '%s', failure.message);
    return
end
arena = greys > 0;
colormask = uint8(greys);
end
