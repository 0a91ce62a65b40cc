function ref = kopen(port, baud, timeout)
% kopen  Open the port of a real robot.
%
%   ref = kopen([number baud timeout]) opens a serial port: 0 is COM1 on Windows and /dev/ttyS0 elsewhere, 1 the next.
%   baud is the speed of the line [bit/s, 9600 if left out] and timeout how long to wait for a reply [s, 1 if left out].
%   A timeout of 100 is 100 seconds: each command waits that long for a robot that is switched off.
%
%   ref = kopen(name, baud, timeout) opens a port by its name:
%     kopen('/dev/ttyUSB0', 9600, 1)          a serial port
%     kopen('COM3')                           one of Windows, 9600 bit/s, 1 s
%     kopen('127.0.0.1:10020')                a TCP port, of kiks serve or of a device server; so does
%     kopen('socket://127.0.0.1:10020')
%
%   ref = kopen([-1 9600 1]) opens a simulated robot, as kiks_kopen does.
%
%   Returns [number baud timeout handle], 1x4, for the functions named k...; a port with a name has a number that is
%   free, from 100 on, unless it is one of those above. handle is different each time. kopen sends nothing, so the robot
%   may be switched on later. It is an error if the port does not open or is open already.
%
%   In Octave this needs the package instrument-control; without it, serial ports work on Linux only.
%
%   Example:
%     ref = kopen('/dev/ttyUSB0', 9600, 1);
%     kSetSpeed(ref, 5, 5);
%     kProximity(ref)
%     kStop(ref);
%     kclose(ref)
%
%   See also kclose, ksend, kcmd, kiks_kopen.

accept_old_style();
if nargin < 1
    error('kiks:argument', 'kopen needs a port. Give kopen([0 9600 1]) or kopen(''/dev/ttyUSB0'', 9600, 1).');
end
port = plain_text(port);
if ischar(port) && size(port, 1) == 1
    if nargin < 2 || isempty(baud)
        baud = 9600;
    end
    if nargin < 3 || isempty(timeout)
        timeout = 1;
    end
    name = port;
    number = serial_number(name);
elseif isnumeric(port) && any(numel(port) == 1:3) && isfinite(port(1)) && port(1) == round(port(1))
    if port(1) < 0
        ref = kiks_kopen(port);
        return
    end
    settings = [0 9600 1];
    settings(1:numel(port)) = port;
    number = settings(1);
    baud = settings(2);
    timeout = settings(3);
    name = serial_name(number);
else
    error('kiks:argument', ['port must be [number baud timeout] or a name, but it was %s. Give kopen([0 9600 1]) ' ...
        'or kopen(''/dev/ttyUSB0'', 9600, 1).'], shown(port));
end
if ~isnumeric(baud) || ~isscalar(baud) || ~(baud > 0 && baud < Inf)
    error('kiks:argument', 'baud must be a speed above 0 [bit/s], but it was %s. Give 9600.', shown(baud));
end
if ~isnumeric(timeout) || ~isscalar(timeout) || ~(timeout >= 0)
    error('kiks:argument', 'timeout must be a time from 0 on [s], but it was %s. Give 1.', shown(timeout));
end
opened = robot_link('open', number, name, baud);
ref = [opened(1) baud timeout opened(2)];
end

function name = serial_name(number)
if ispc()
    name = sprintf('COM%d', number + 1);
else
    name = sprintf('/dev/ttyS%d', number);
end
end

function number = serial_number(name)
% The number with which kopen([number ...]) opens the same port; [] if there is none.
number = sscanf(upper(name), 'COM%d', 1) - 1;
if isempty(number)
    number = sscanf(name, '/dev/ttyS%d', 1);
end
if ~isempty(number) && ~strcmpi(serial_name(number), name)
    number = [];
end
end
