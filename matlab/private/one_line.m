function text = one_line(text)
% one_line  Make a text fit into a message: one line of at most 80 characters.

text = regexprep(strtrim(regexprep(text, '[\x00-\x20\x7f]+', ' ')), '(.{77}).{4,}', '$1...');
end
