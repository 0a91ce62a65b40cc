function path_name = arena_file(file)
% arena_file  Find an arena's file: in the current folder, else, if no folder is named, on the path.

endings = {'.kad', '.tif', '.tiff', '.png', '.bmp', '.pgm', '.pbm', '.ppm', '.toml', '.kiks'};
[folder, ~, ending] = fileparts(file);
if ~any(strcmpi(ending, endings))
    error('kiks:argument', ['The name of an arena''s file must end in one of%s, but it was %s. ' ...
        'Give it with its ending.'], sprintf(' %s', endings{:}), shown(file));
end
path_name = absolute_path(file);
if exist_file(path_name)
    return
end
if isempty(folder)
    folders = strsplit(path(), pathsep());
    for k = 1:numel(folders)
        path_name = absolute_path(fullfile(folders{k}, file));
        if exist_file(path_name)
            return
        end
    end
end
error('kiks:argument', ['The arena''s file must exist, but %s is neither in %s nor on the path. ' ...
    'Look for slips in its name, or give it with its folder.'], shown(file), pwd());
end

function there = exist_file(path_name)
there = exist(path_name, 'file') == 2;
end
