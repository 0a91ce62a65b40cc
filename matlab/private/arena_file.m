function path_name = arena_file(file)
% arena_file  Find an arena's file, also by its name without ending.
%
%   A name without a folder is looked for in the current folder, beside the running program, on the path, and among the
%   arenas that come with KiKS.

endings = arena_endings();
candidates = {file};
[folder, ~, ending] = fileparts(file);
if ~any(strcmpi(ending, endings))
    candidates = strcat(file, endings);
end
folders = {pwd()};
if isempty(folder)
    folders = [folders, program_folders(), strsplit(path(), pathsep()), {arena_folder()}];
end
for k = 1:numel(folders)
    for j = 1:numel(candidates)
        path_name = candidates{j};
        if k > 1
            path_name = fullfile(folders{k}, path_name);
        end
        path_name = absolute_path(path_name);
        if exist(path_name, 'file') == 2
            return
        end
    end
end
if numel(candidates) > 1
    tried = sprintf('%s with one of the endings%s', shown(file), sprintf(' %s', endings{:}));
else
    tried = shown(file);
end
error('kiks:argument', ['The arena''s file must exist, but %s is neither in %s nor beside the program, on the path ' ...
    'or among KiKS''s own. %s'], tried, pwd(), arenas_there());
end

function folders = program_folders()
% The folders of the functions and scripts that have called the toolbox.
calls = dbstack('-completenames');
folders = cellfun(@fileparts, {calls.file}, 'UniformOutput', false);
toolbox = fileparts(fileparts(mfilename('fullpath')));
folders = folders(~strncmp(folders, toolbox, numel(toolbox)) & ~cellfun(@isempty, folders));
end
