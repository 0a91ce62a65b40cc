function preferences = prepare_process()
% prepare_process  Read the preferences, and set whether a new process opens a window.

preferences = read_preferences();
if ~simulator('--is-running', []) && ~isempty(preferences.KIKS_WINDOW)
    setenv('KIKS_WINDOW', sprintf('%d', preferences.KIKS_WINDOW));
end
end
