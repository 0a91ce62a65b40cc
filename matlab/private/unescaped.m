function text = unescaped(text)
% unescaped  Undo escaped.
%
%   See also escaped.

if any(text == 92)
    % A character that occurs nowhere else keeps '\\n' from being read as a backslash and a line feed.
    text = strrep(text, '\\', char(1));
    text = strrep(strrep(text, '\n', char(10)), '\r', char(13));
    text = strrep(text, char(1), '\');
end
end
