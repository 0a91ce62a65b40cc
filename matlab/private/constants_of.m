function [values, is_function] = constants_of(file)
% constants_of  The constants KIKS_... that a file .m sets, in a struct, and whether it is a function.
%
%   The file may be a script, or, as in KiKS 2.2.0, a function that sets global variables. What is global before is so
%   again afterwards: else the file's values would count as a program's own, and outlast a change of the file.
%
%   The file runs as a copy under a name of its own, as Octave caches which file a name stands for, and a function can
%   be called only by its file's name.

persistent count
[folder, base] = fileparts(file);
text = fileread(file);
if any(text == 0)
    error('kiks:argument', 'it is no text: it has characters of number 0');
end
count = sum(count) + 1;
name = sprintf('kiks_constants_%d', count);
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
opened = fopen(copy, 'w');
fwrite(opened, text);
fclose(opened);
addpath(home);
% Octave warns of a function that is named otherwise than its file.
shown_before = warning('query', 'Octave:function-name-clash');
warning('off', shown_before.identifier);
showing = onCleanup(@() warning(shown_before.state, shown_before.identifier)); %#ok<NASGU>
try
    values = values_of_run(name);
catch failure
    error('kiks:argument', '%s', strrep(strrep(one_line(failure.message), home, folder), name, base));
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
