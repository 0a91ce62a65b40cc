function text = escaped(text)
% escaped  Make one line of a text: the simulator's process is spoken to in lines.
%
%   text = escaped(text) writes line feeds, carriage returns and backslashes as \n, \r and \\.
%
%   See also unescaped.

if any(text == 92 | text == 10 | text == 13)
    text = strrep(strrep(strrep(text, '\', '\\'), char(10), '\n'), char(13), '\r');
end
end
