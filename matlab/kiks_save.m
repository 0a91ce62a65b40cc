function kiks_save(file)
% kiks_save  Write the world to a file.
%
%   kiks_save(file) writes the present world: walls, start poses and things. The ending says how:
%
%     .kad    arena of KiKS 2.2.0 (which reads only its walls)
%     .toml   arena file with a picture beside it
%     .kiks   project: the arena and all settings
%
%   An existing file of that name is replaced. kiks_save lets you choose a name and a kind of file in a dialog, if there
%   is a display.
%
%   Example:
%     kiks, kiks_save('mine.kad'), kiks_quit
%
%   See also kiks_load.

if nargin < 1
    need_session('kiks_save');
    kinds = {'*.kiks', 'Projects: the arena and all settings'
        '*.toml', 'Arenas'
        '*.kad', 'Arenas of KiKS 2.2.0'};
    file = asked_file(@uiputfile, kinds, 'Save the world', ...
        ['kiks_save needs the name of a file. Call kiks_save(''arena.kad''). ' arenas_there()]);
    if isempty(file)
        return
    end
end
file = plain_text(file);
[~, ~, ending] = fileparts_of(file);
if ~any(strcmpi(ending, {'.kad', '.toml', '.kiks'}))
    error('kiks:argument', ['The file''s name must end in .kad, .toml or .kiks, but it was %s. ' ...
        'Call kiks_save(''arena.kad'').'], shown(file));
end
need_session('kiks_save');
simulator(['save ' escaped(absolute_path(file))]);
end

function [folder, name, ending] = fileparts_of(file)
if ~ischar(file) || size(file, 1) ~= 1
    file = '';
end
[folder, name, ending] = fileparts(file);
end
