function path_name = absolute_path(file)
% absolute_path  Name a file from the root: the simulator's process has a current folder of its own.

if strncmp(file, '~/', 2) && ~ispc()
    file = [getenv('HOME') file(2:end)];
end
is_absolute = ~isempty(file) && (file(1) == '/' || (ispc() && ~isempty(regexp(file, '^([A-Za-z]:)?[\\/]', 'once'))));
if is_absolute
    path_name = file;
else
    path_name = fullfile(pwd(), file);
end
end
