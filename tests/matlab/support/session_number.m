function number = session_number()
% session_number  The number of this test's session, which is that of its process; 0 if there is none.

doors = dir(fullfile(getenv('XDG_RUNTIME_DIR'), 'kiks', 'session-*'));
number = 0;
if ~isempty(doors)
    number = sscanf(doors(1).name, 'session-%d');
end
end
