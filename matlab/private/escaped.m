function text = escaped(text)
% escaped  Write a text as one line, as requests to the simulator's process are lines.
%
%   text = escaped(text) writes line feeds, carriage returns and backslashes as \n, \r and \\.
%
%   See also unescaped.

if any(text == 92 | text == 10 | text == 13)
    text = strrep(strrep(strrep(text, '\', '\\'), char(10), '\n'), char(13), '\r');
end
end
