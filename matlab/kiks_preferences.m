% kiks_preferences  Constants of the simulation, for the user to change.
%
%   This file is a script that sets constants. Copy it into the folder of your programs and change it there: the copy
%   in the current folder wins, and may hold only the lines that differ. A program can also set a constant as a global
%   variable, which wins over both:
%
%     global KIKS_SEED, KIKS_SEED = 7; kiks
%
%   The constants are read whenever a world begins: by kiks, kiks_arena, kiks_load, and by a kiks_kopen that starts
%   a session. Some of KiKS 2.2.0 have nothing to do any more; they are accepted, and a value other than here is
%   answered with a line that says why.
%
%   Example:
%     kiks_preferences, KIKS_SEED
%
%   See also kiks, kiks_arena.

% The seed of all random numbers (noise, wheel slip, random places), from 0 on: the same seed gives the same run.
KIKS_SEED = 0;

% How long a program takes between a reply and its next command, in the robot's time: 'live' as long as it really takes,
% 'live:FACTOR' that many times as long, 'fixed:MS' always MS milliseconds, 'none' no time. With 'fixed' and
% 'none' each run of a program is the same.
KIKS_THINKING = 'live';

% Let a program think as slowly as on another computer: its name, e.g. '300 MHz Celeron-A', or its index (see
% kiks_speedtest). '' is this computer. The index of this one is taken from kiks_data.mat (kiks_calibrate) in the
% current folder, else measured once, for two seconds. Then KIKS_THINKING is live with the factor that follows.
KIKS_EMULATED_CPU = '';

% 'Khepera', 'Khepera_II', or the name of a robot's file .toml.
KIKS_ROBOT = 'Khepera';

% The model of its proximity sensors: '' the robot's own, 'reflection', 'thesis', 'fast', 'standin' or 'curve'.
KIKS_RESPONSE = '';

% 1: sensors are noisy; 0: they are not.
KIKS_NOISE = 1;

% The turrets on each robot, of: k213 radio battle gripper.
KIKS_TURRETS = 'k213 radio battle';

% The number of robots; [] for the number of start poses in the arena, at least one.
KIKS_ROBOTS = [];

% The number of programs (Octaves, see kiks('--join')) that start together: the world waits until each has opened its
% port, and then for each. So runs of several programs are repeatable, with 'fixed' and 'none'. 1: each starts when it
% joins.
KIKS_PROGRAMS = 1;

% The meaning of elements 2, 3 and 4 of an arena matrix: 'kiks' (light, ball, cylinder) or 'thesis' (ball, light,
% cylinder).
KIKS_ARENA_CODING = 'kiks';

% Whether a window shows the world: [] if there is a display, 0 never, 1 always. It is read when a session starts.
KIKS_WINDOW = [];

% The brightness of things as sensors see them, 1 black to 255 white. [] suits the response: white balls, wooden
% cylinders and the robot's own brightness with the responses of real robots; the values of KiKS 2.2.0 (ball 25,
% cylinder 70, robot 120) with 'thesis', 'fast' and 'standin', which use its rule of colours. A sensor that measures
% reflected light hardly sees a ball of 25.
KIKS_COLOR_BALL = [];
KIKS_COLOR_CYLINDER = [];
KIKS_COLOR_ROBOT = [];

% The brightness of walls without an own one, 1 to 255.
KIKS_ARENA_DEFAULT_COLOR = 255;

% The number of lines that kiks_status keeps.
KIKS_LOG_HISTORY = 1000;

% Without effect: responses and noise are measured ones (KIKS_RESPONSE, KIKS_NOISE).
KIKS_SIM_PROX_EMAX = 0.25;
KIKS_SIM_PROX_EMIN = 0.10;
KIKS_SIM_PROX_EEXP = 3;
KIKS_SIM_PROX_NOISE = 1;
KIKS_SIM_LIGHT_FEXP = 5;
KIKS_K213_NOISE = 10;
KIKS_K213_NONORMALIZE = [];

% Without effect: rays and movement are exact.
KIKS_SIM_PROX_STEP = 5;
KIKS_K213_STEP = 10;
KIKS_MMPERPIXEL = 2;

% The most points of a path (kiks_siminfo_robotpath). At first there are 25 a second. When there are more than this,
% every second point is dropped, and from then on half as many come.
KIKS_TRACE_MAX = 8^5;

% The film that the next kiks_kopen begins and kiks_kclose ends (see kiks_recordmovie); '' for none.
KIKS_MOVIENAME = '';

% Without effect: films are H.264, in a quality of their own.
KIKS_MOVIECOMPRESSION = 'Indeo5';
KIKS_MOVIEQUALITY = 50;
