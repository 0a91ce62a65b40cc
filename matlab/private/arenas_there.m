function text = arenas_there()
% arenas_there  Say which arenas there are in the current folder, and which come with KiKS.

text = [names_in(pwd(), 'Arenas in the current folder: %s. '), names_in(arena_folder(), 'Those of KiKS: %s. ')];
if isempty(text)
    text = 'There is no other arena either.';
end
text = strtrim(text);
end

function text = names_in(folder, form)
most = 12;
found = dir(folder);
names = {found(~[found.isdir]).name};
endings = cell(size(names));
for k = 1:numel(names)
    [~, names{k}, endings{k}] = fileparts(names{k});
end
is_arena = cellfun(@(ending) any(strcmpi(ending, arena_endings())), endings);
names = unique(names(is_arena));
text = '';
if ~isempty(names)
    more = '';
    if numel(names) > most
        more = sprintf(' and %d more', numel(names) - most);
        names = names(1:most);
    end
    text = sprintf(form, [strjoin(cellfun(@one_line, names, 'UniformOutput', false), ', ') more]);
end
end
