function file = asked_file(ask, kinds, title, need)
% asked_file  Let the user choose a file in a dialog; '' if there is no choice made.
%
%   file = asked_file(ask, kinds, title, need) calls ask, @uigetfile or @uiputfile. A name that is typed without an
%   ending gets that of the chosen kind of file. Where no dialog can be opened, it stops with the message need.
%
%   kinds    what the dialog offers: rows of patterns, such as '*.png;*.tif', and their names

if ~has_display()
    error('kiks:argument', '%s', need);
end
try
    [name, folder] = ask(kinds, title);
catch
    error('kiks:argument', '%s', need);
end
file = '';
if ischar(name)
    file = fullfile(folder, name);
end
end
