function need_display(who, instead)
% need_display  Stop with a message if no window can be opened.
%
%   need_display(who, instead) names the function that draws and says what does the same without a window.

if is_octave()
    has_display = have_window_system();
else
    has_display = feature('ShowFigureWindows');
end
if ~has_display
    error('kiks:display', '%s must open a window, but there is no display here. %s', who, instead);
end
end
