function kBraitenbergG(ref, gain, seconds)
% kBraitenbergG  Let the robot drive about and avoid obstacles, and draw its path.
%
%   kBraitenbergG(ref, gain, seconds) does what kBraitenberg does, gain being its speed, and draws the path that the
%   counters of the wheels tell [mm, from the start, heading to the right]. It ends when the window is
%   closed, on Ctrl-C, or after that many seconds by kiks_ktime if they are given. The robot stops at the end.
%
%   The counters are set to 0. It is an error if there is no display or the robot does not answer.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]);
%     kBraitenbergG(ref)
%     kiks_kclose(ref)
%
%   See also kBraitenberg, kProximityG, kiks_siminfo_robotpath.

if nargin < 1
    ref = [];
end
need_ref(ref);
if nargin < 2 || isempty(gain)
    gain = 0.7;
end
if nargin < 3
    seconds = [];
end
parameters(gain, 1, 'gain (a factor)', 'kBraitenbergG(ref, 0.7)');
need_display('kBraitenbergG', 'kBraitenberg(ref) drives without one.');
[start, seconds] = time_limit(ref, seconds);
window = figure('Name', 'kBraitenbergG', 'NumberTitle', 'off');
line_ = plot(0, 0);
axis('equal');
xlabel('x [mm]');
ylabel('y [mm]');
title('Path by the wheels'' counters; close the window to end');
drawnow();
kSetEncoders(ref, 0, 0);
pose = [0; 0; 0];
path_ = pose(1:2);
before = [0; 0];
drawn = builtin('tic');
stopper = onCleanup(@() stop_robot(ref)); %#ok<NASGU>
while ishandle(window) && (seconds == Inf || kiks_ktime(ref(1)) - start < seconds)
    braitenberg_step(ref, gain);
    pulses = kGetEncoders(ref);
    if numel(pulses) == 2
        pose = moved(pose, kiks_p2mm(pulses - before));
        before = pulses;
        if norm(pose(1:2) - path_(:, end)) > 2
            path_(:, end + 1) = pose(1:2); %#ok<AGROW>
        end
    end
    if builtin('toc', drawn) > 0.05 && ishandle(line_)
        set(line_, 'XData', [path_(1, :) pose(1)], 'YData', [path_(2, :) pose(2)]);
        drawnow();
        drawn = builtin('tic');
    end
end
end

function pose = moved(pose, ways)
% The wheels are 53 mm apart. For a short way the arc is the chord in the mean direction.
turn = (ways(2) - ways(1)) / 53;
direction = pose(3) + turn / 2;
pose = pose + [mean(ways) * cos(direction); mean(ways) * sin(direction); turn];
end
