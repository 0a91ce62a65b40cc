function need_display(name, instead)
% need_display  Stop with a message if no window can be opened.
%
%   need_display(name, instead) names the function that draws and the alternative without a window.

if ~has_display()
    error('kiks:display', '%s must open a window, but there is no display here. %s', name, instead);
end
end
