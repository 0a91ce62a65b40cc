function file = first_file(folders, names)
% first_file  Find the first file of some names, folder by folder; '' if there is none.
%
%   file = first_file(folders, names) takes rows of cells. The folder '' stands for the current one.

for folder = folders
    for name = names
        file = absolute_path(fullfile(folder{1}, name{1}));
        if exist(file, 'file') == 2
            return
        end
    end
end
file = '';
end
