function kProximityG(ref, kind, seconds)
% kProximityG  Show the proximity sensors in a window.
%
%   kProximityG(ref, kind, seconds) reads and draws the eight sensors of robot ref repeatedly: kind is
%   'bar', which it is if left out, or 'polar', around a robot that looks upwards. It ends when the window is closed,
%   on Ctrl-C, or after that many seconds by kiks_ktime if they are given. The robot does not move.
%
%   It is an error if there is no display or the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kProximityG(ref, 'polar')
%     kiks_kclose(ref)
%
%   See also kProximity, kBraitenbergG.

if nargin < 1
    ref = [];
end
need_ref(ref);
if nargin < 2 || isempty(kind)
    kind = 'bar';
end
if nargin < 3
    seconds = [];
end
kind = plain_text(kind);
if ~ischar(kind) || ~any(strcmp(kind, {'bar', 'polar'}))
    error('kiks:argument', 'kind must be ''bar'' or ''polar'', but it was %s. Give kProximityG(ref, ''polar'').', ...
        shown(kind));
end
need_display('kProximityG', 'kProximity(ref) returns the readings.');
[start, seconds] = time_limit(ref, seconds);
readings = checked(kProximity(ref));
window = figure('Name', 'kProximityG', 'NumberTitle', 'off');
if strcmp(kind, 'bar')
    drawing = bar(1:8, readings);
    axis([0.3 8.7 0 1023]);
    set(gca(), 'XTick', 1:8, 'XTickLabel', ...
        {'left', 'front left', 'front', 'front', 'front right', 'right', 'rear right', 'rear left'});
    ylabel('reading [counts]');
else
    drawing = plot(0, 0, 'LineWidth', 4);
    hold('on');
    around = linspace(0, 2 * pi, 73);
    plot(1023 * cos(around), 1023 * sin(around), 'k:');
    hold('off');
    axis('equal');
    axis([-1100 1100 -1100 1100]);
end
title('Proximity; close the window to end');
while ishandle(window) && (seconds == Inf || kiks_ktime(ref(1)) - start < seconds)
    readings = checked(kProximity(ref));
    if ~ishandle(drawing)
        return
    elseif strcmp(kind, 'bar')
        set(drawing, 'YData', readings);
    else
        [x, y] = rays(readings);
        set(drawing, 'XData', x, 'YData', y);
    end
    drawnow();
end
end

function readings = checked(readings)
if numel(readings) ~= 8
    error('kiks:link', 'The robot must answer, but it was silent three times. See that it is switched on.');
end
end

function [x, y] = rays(readings)
% Both rear sensors point straight back; they are drawn apart to be distinguishable.
angles = pi / 2 + [90 45 10 -10 -45 -90 -165 165]' * pi / 180;
gap = nan(8, 1);
x = [zeros(8, 1) readings .* cos(angles) gap]';
y = [zeros(8, 1) readings .* sin(angles) gap]';
x = x(:)';
y = y(:)';
end
