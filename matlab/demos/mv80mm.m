function mv80mm(port, baud)
% mv80mm  Demo: drive 80 mm, by time and by the counters of the wheels.
%
%   mv80mm(port, baud) moves the robot on port (-1, the simulated one; a real one as in kopen) at baud (9600) twice.
%   First it drives at 40 mm/s for two seconds: the speed is rounded to 5 pulses/10 ms, 41 mm/s, so it comes 82 mm far.
%   Then the position controllers bring the wheels 80 mm further. It prints both ways as the wheels have counted them.
%
%   Example:
%     mv80mm
%
%   See also kSetSpeed, kMoveTo, kSetProfile, kGetStatus, kiks_mm2p.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end

ref = opened(port, baud);
closing = onCleanup(@() leave(ref)); %#ok<NASGU>

% By time. A pulse each 10 ms is 100 pulses a second.
speed = round(kiks_mm2p(40) / 100);
kSetEncoders(ref, 0, 0);
kSetSpeed(ref, speed, speed);
start = kiks_ktime(ref);
while kiks_ktime(ref) - start < 2
end
kSetSpeed(ref, 0, 0);
kiks_pause(0.3);
fprintf('mv80mm: %.1f mm in two seconds at speed %d.\n', kiks_p2mm(mean(kGetEncoders(ref))), speed);

% By the counters.
kSetEncoders(ref, 0, 0);
kSetProfile(ref, 40, 96, 40, 96);
kMoveTo(ref, kiks_mm2p(80), kiks_mm2p(80));
status = kGetStatus(ref);
while numel(status) == 6 && status(1) + status(4) < 2
    status = kGetStatus(ref);
end
fprintf('mv80mm: %.1f mm with kMoveTo.\n', kiks_p2mm(mean(kGetEncoders(ref))));
end
