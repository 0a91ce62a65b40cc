function preferences = prepare_process()
% prepare_process  Read the preferences, and tell a process that is not there yet whether to open a window.

preferences = read_preferences();
if ~simulator('--is-running', []) && ~isempty(preferences.KIKS_WINDOW)
    setenv('KIKS_WINDOW', sprintf('%d', preferences.KIKS_WINDOW));
end
end
