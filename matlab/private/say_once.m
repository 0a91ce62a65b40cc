function say_once(name, text)
% say_once  Print a line, but each name's line only once.

persistent said
if isempty(said)
    said = {};
end
if ~any(strcmp(name, said))
    said{end + 1} = name;
    disp(text);
end
end
