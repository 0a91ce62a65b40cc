function ref = kiks_kopen(port, varargin)
% kiks_kopen  Open a robot, simulated or real.
%
%   ref = kiks_kopen([port baud timeout]) returns the reference that all other functions take.
%
%   port      -1 for the simulated robot of this program, -2, -3, ... for further ones; 0, 1, ... for a real robot on a
%             serial port, as in kopen
%   baud      speed of the line [bit/s], 9600 if it is left out
%   timeout   how long to wait for a real robot [s], 1 if it is left out; a simulated one needs none
%
%   kiks_kopen without an argument opens [-1 9600 1]. A port with a name, kiks_kopen('/dev/ttyUSB0', 9600, 1), is real:
%   see kopen. ref is [-n -n -n -n] for the simulated port -n, and kiks_kopen(ref) opens that port again at 9600 baud.
%
%   If there is no session, one starts with the default arena. Time and distances of the port begin at 0; encoders stay
%   as they are. An error if the port is open: kiks_kclose([]) closes it. After clear all, an open port is closed first.
%
%   Example:
%     ref = kiks_kopen([-1 9600 1]); kProximity(ref), kiks_kclose(ref)
%
%   See also kiks_kclose, kiks_ksend, kiks_ktime, kiks.

accept_old_style();
settings = [-1 9600 1];
if nargin > 0 && ischar(plain_text(port))
    ref = kopen(port, varargin{:});
    return
elseif nargin > 0 && ~isempty(port)
    if ~isnumeric(port) || numel(port) > 4 || ~all(isfinite(port)) || port(1) ~= fix(port(1))
        error('kiks:argument', ['The port must be given as [port baud timeout], port being a whole number, but it ' ...
            'was %s. Call kiks_kopen([-1 9600 1]).'], shown(port));
    end
    count = min(numel(port), 3);
    if numel(port) == 4 && port(1) < 0 && all(port == port(1))
        count = 1;  % a reference
    end
    settings(1:count) = port(1:count);
end
if settings(2) <= 0 || settings(3) < 0
    error('kiks:argument', ['Baud must be larger than 0 and timeout not negative, but they were %g and %g. ' ...
        'Call kiks_kopen([-1 9600 1]).'], settings(2), settings(3));
end
if settings(1) >= 0
    ref = kopen(settings);
    return
end
if is_active()
    preferences = read_preferences();
    if isempty(global_value('KIKS_SESSIONACTIVE')) && any(open_ports('list') == -settings(1))
        kiks_kclose(settings([1 1 1 1]));  % left open by a program that has forgotten it with `clear all`
    end
else
    preferences = begin_world([], []);
end
global_value('KIKS_SESSIONACTIVE', 1);
simulator(sprintf('open %d %.10g', -settings(1), settings(2)));
open_ports('add', -settings(1));
% Another program may have begun another world.
pulse_mm('forget');
ref = settings([1 1 1 1]);
kiks_ksend(['B' char(10)], ref);
try
    film('begin', -settings(1), preferences.KIKS_MOVIENAME);
catch failure
    kiks_kclose(ref);
    rethrow(failure);
end
end
