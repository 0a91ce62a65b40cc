function endings = arena_endings()
% arena_endings  The endings of arenas' files; of files of one name the first is taken.
%
%   A file that names another one, such as the picture beside it, comes before that.

endings = {'.toml', '.kiks', '.kad', '.tif', '.tiff', '.png', '.bmp', '.pgm', '.pbm', '.ppm'};
end
