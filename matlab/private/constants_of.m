function values = constants_of(folder)
% constants_of  The constants that kiks_preferences.m in a folder sets, in a struct.
%
%   The file may be a script, or, as in KiKS 2.2.0, a function that sets global variables. What is global before is so
%   again afterwards: else the file's values would count as a program's own, and outlast a change of the file.

[values, is_function] = values_of_copy(fileread(fullfile(folder, 'kiks_preferences.m')), folder);
if is_function
    % The file of KiKS 2.2.0 sets each constant. Greys that are still as they came with it were chosen by nobody.
    shipped = greys_of_kiks_2();
    names = fieldnames(shipped);
    for k = 1:numel(names)
        if isfield(values, names{k}) && isequal(values.(names{k}), shipped.(names{k}))
            values = rmfield(values, names{k});
        end
    end
end
end

function [values, is_function] = values_of_copy(text, folder)
% The file runs as a copy under a name of its own, as Octave caches which file a name stands for, and a function can be
% called only by its file's name.
persistent count
if any(text == 0)
    error('kiks:argument', 'it is no text: it has characters of number 0');
end
count = sum(count) + 1;
name = sprintf('kiks_preferences_%d', count);
home = tempname();
[is_made, why] = mkdir(home);
if ~is_made || ~isempty(why)
    error('a folder %s for its copy cannot be made: %s', home, why);
end
copy = fullfile(home, [name '.m']);
text = in_utf8(text);
globals = unique(regexp(text, '\<KIKS_\w+', 'match'));
before = cell(size(globals));
for k = 1:numel(globals)
    before{k} = global_value(globals{k}, []);
end
cleaning = onCleanup(@() clean_up(home, copy, globals, before)); %#ok<NASGU>
file = fopen(copy, 'w');
fwrite(file, text);
fclose(file);
addpath(home);
% Octave warns of a function that is named otherwise than its file.
shown_before = warning('query', 'Octave:function-name-clash');
warning('off', shown_before.identifier);
showing = onCleanup(@() warning(shown_before.state, shown_before.identifier)); %#ok<NASGU>
try
    values = values_of_run(name);
catch failure
    error('kiks:argument', '%s', strrep(strrep(failure.message, home, folder), name, 'kiks_preferences'));
end
is_function = isempty(fieldnames(values));
for k = 1:numel(globals)
    value = global_value(globals{k});
    if ~isempty(value)
        values.(globals{k}) = value;
    end
end
end

function kiks_values = values_of_run(kiks_name)
% A script has this workspace for itself.
eval([kiks_name ';']);
kiks_values = struct();
for kiks_name = who('KIKS_*')'
    kiks_values.(kiks_name{1}) = eval(kiks_name{1});
end
end

function clean_up(home, copy, globals, before)
for k = 1:numel(globals)
    global_value(globals{k}, before{k});
end
if ~isempty(strfind([pathsep() path() pathsep()], [pathsep() home pathsep()])) %#ok<STREMP>
    rmpath(home);
end
if exist(copy, 'file')
    delete(copy);
end
rmdir(home);
end

function text = in_utf8(text)
% Octave takes only that. What is in another encoding is from Windows, in Western Europe.
try
    regexp(text, ' ', 'once');
catch
    text = native2unicode(uint8(text), 'windows-1252');
end
end
