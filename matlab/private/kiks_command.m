function command = kiks_command()
% kiks_command  The command that starts the simulator, as a row of words.
%
%   It is the environment variable KIKS_COMMAND, else the command of the Python environment that this folder
%   belongs to, else `kiks` on the system's path, else where pip installs the commands of one user: an Octave or
%   MATLAB that a desktop has started does not always have that folder on its path.

given = getenv('KIKS_COMMAND');
if ~isempty(given)
    command = strsplit(strtrim(given), ' ');
    return
end
name = 'kiks';
if ispc()
    name = 'kiks.exe';
end
toolbox = fileparts(fileparts(mfilename('fullpath')));
% Beside a checkout stands .venv; a package lies in lib/python3.x/site-packages/kiks/matlab.
folders = {fullfile(toolbox, '..', '.venv', 'bin'), fullfile(toolbox, '..', '..', '..', '..', '..', 'bin'), ...
    fullfile(toolbox, '..', '..', '..', '..', 'Scripts')};
folders = [folders, strsplit(getenv('PATH'), pathsep()), {fullfile(getenv('HOME'), '.local', 'bin')}];
folders = folders(~cellfun(@isempty, folders));
for k = 1:numel(folders)
    candidate = fullfile(folders{k}, name);
    if exist(candidate, 'file') == 2
        command = {candidate};
        return
    end
end
command = {name};
end
