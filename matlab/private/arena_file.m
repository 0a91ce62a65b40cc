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
folders = {''};
if isempty(folder)
    folders = [folders, program_folders(), strsplit(path(), pathsep()), {arena_folder()}];
end
path_name = first_file(folders, candidates);
if ~isempty(path_name)
    return
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
