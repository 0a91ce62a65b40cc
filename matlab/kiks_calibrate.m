function kiks_calibrate(port, baud, ~)
% kiks_calibrate  Measure this computer, and the line to a real robot.
%
%   kiks_calibrate measures the computer speed index, see kiks_speedtest.
%
%   kiks_calibrate(port, baud) also measures how much longer commands take with the real robot on port (0, 1, ..., or a
%   name like '/dev/ttyUSB0') than simulated, at baud (9600). The robot does not drive. Ten times baud/64 commands (set
%   encoders, read encoders, stop) go to the real robot and then to a simulated one. The difference for one command,
%   times baud, is K, in seconds * baud: the mean of the second to the ninth of the ten, sorted. V is the ninth less
%   the second. The present session ends.
%
%   A third argument has no effect: KiKS 2.2.0 took one.
%
%   Both are written into kiks_data.mat in the current folder, as KIKS_COMPUTER_SPEED, KIKS_KSEND_CONSTANT (K),
%   KIKS_CALIBRATE_BAUD and KIKS_KSEND_VARIATION (V). Without a real robot an earlier file's values for the line stay.
%
%   What is used of it, by worlds that begin in that folder: each command takes K / KIKS_CALIBRATE_BAUD seconds longer;
%   the speed index goes into KIKS_EMULATED_CPU. V is for you to know. Delete the file and all is as without.
%
%   Example:
%     kiks_calibrate
%
%   See also kiks_speedtest, kiks_preferences.

if nargin < 1 || isempty(port)
    port = -1;
end
if nargin < 2 || isempty(baud)
    baud = 9600;
end
advice = 'Call kiks_calibrate(0, 9600) with a real robot.';
port = plain_text(port);
if ~ischar(port)
    check_whole('The port', port, -1, 1e6, advice);
end
check_whole('The baud', baud, 64, 1e7, advice);
known = calibration();
known.KIKS_COMPUTER_SPEED = kiks_speedtest(3);
fprintf('The computer speed index is %.3g.\n', known.KIKS_COMPUTER_SPEED);
if ischar(port) || port >= 0
    known.KIKS_CALIBRATE_BAUD = baud;
    [known.KIKS_KSEND_CONSTANT, known.KIKS_KSEND_VARIATION] = line_constants(port, baud);
    fprintf('K is %.3g +- %.1f %%: at %d baud a command takes %.2f ms longer with the real robot.\n', ...
        known.KIKS_KSEND_CONSTANT, 100 * abs(known.KIKS_KSEND_VARIATION / (2 * known.KIKS_KSEND_CONSTANT)), baud, ...
        1000 * known.KIKS_KSEND_CONSTANT / baud);
end
file = fullfile(pwd(), 'kiks_data.mat');
save(file, '-struct', 'known', '-v6');
fprintf('It is written into %s.\n', file);
end

function [constant, variation] = line_constants(port, baud)
kiks_quit(1);
if ischar(port)
    real_ref = kopen(port, baud, 1);
else
    real_ref = kopen([port baud 1]);
end
closing = onCleanup(@() both_closed(real_ref));
changes = struct('KIKS_THINKING', 'live', 'KIKS_EMULATED_CPU', '', 'is_uncalibrated', true);
begin_world([], [], changes);
simulated_ref = kiks_kopen([-1 baud 1]);
count = round(baud / 64);
differences = zeros(1, 10);
for k = 1:10
    begin = builtin('tic');
    exchange(real_ref, count);
    real_s = builtin('toc', begin);
    begin_s = kiks_ktime(-1);
    exchange(simulated_ref, count);
    differences(k) = (real_s - (kiks_ktime(-1) - begin_s)) / count * baud;
end
differences = sort(differences);
constant = mean(differences(2:9));
variation = differences(9) - differences(2);
end

function exchange(ref, count)
texts = strcat({'G,0,0', 'H', 'D,0,0'}, {char(10)});
for k = 1:count
    if isempty(kiks_ksend(texts{mod(k - 1, 3) + 1}, ref))
        error('kiks:link', ['The robot must answer each command to be measured, but one was not answered. See that ' ...
            'it is switched on and set to this baud, and call kiks_calibrate again.']);
    end
end
end

function both_closed(real_ref)
kiks_kclose(real_ref);
kiks_quit(1);
end
