function number = session_number()
% session_number  The number of this test's newest session, which is that of its process; 0 if there is none.

doors = dir(fullfile(getenv('XDG_RUNTIME_DIR'), 'kiks', 'session-*'));
number = max([0 cellfun(@(name) sscanf(name, 'session-%d'), {doors.name})]);
end
