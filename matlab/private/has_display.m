function has = has_display()
% has_display  Tell whether windows can be opened.

if is_octave()
    has = have_window_system();
else
    has = feature('ShowFigureWindows');
end
end
