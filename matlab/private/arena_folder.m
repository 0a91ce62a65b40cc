function folder = arena_folder()
% arena_folder  The folder of the arenas that come with KiKS.

folder = fullfile(fileparts(fileparts(fileparts(mfilename('fullpath')))), 'examples', 'arenas');
end
