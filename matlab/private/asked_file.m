function file = asked_file(ask, title, need)
% asked_file  Let the user choose a file in a dialog; '' if there is no choice made.
%
%   file = asked_file(ask, title, need) calls ask, @uigetfile or @uiputfile. Where no dialog can be opened, it stops
%   with the message need.

if ~has_display()
    error('kiks:argument', '%s', need);
end
try
    [name, folder] = ask({'*.kad;*.tif;*.png;*.toml;*.kiks', 'Arenas'}, title);
catch
    error('kiks:argument', '%s', need);
end
file = '';
if ischar(name)
    file = fullfile(folder, name);
end
end
