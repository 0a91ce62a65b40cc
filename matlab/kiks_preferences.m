% kiks_preferences  Constants of the simulation, for the user to change.
%
%   This file is a script that sets constants. Copy it into the folder of your programs and change it there: the copy
%   in the current folder wins, and may hold only the lines that differ. A kiks_preferences.m of KiKS 2.2.0, a function,
%   is read as well. A constant that is [] has the value of this file. A program can also set a constant as a global
%   variable, which wins over all:
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

% 'Khepera', 'Khepera_II', the name of a robot's file .toml, or of a robot definition file .m of KiKS 2.2.0. KiKS looks
% for such a file in the current folder and on the path, there also in folders named robots. '.m' may be left out.
KIKS_ROBOT = 'Khepera';

% The model of its proximity sensors: '' the robot's own ('reflection' of a Khepera, 'curve' of a Khepera II); 'thesis'
% and 'fast' are of both.
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
% cylinder 70, robot 120) with 'thesis' and 'fast', which use its rule of colours. A sensor that measures
% reflected light hardly sees a ball of 25. A KIKS_COLOR_ROBOT of -X stands for X black and X white stripes around
% each robot.
KIKS_COLOR_BALL = [];
KIKS_COLOR_CYLINDER = [];
KIKS_COLOR_ROBOT = [];

% The brightness of walls without an own one, 1 to 255.
KIKS_ARENA_DEFAULT_COLOR = 255;

% The number of lines that kiks_status keeps.
KIKS_LOG_HISTORY = 1000;

% Constants of the sensors' models of KiKS 2.2.0. Here sensors and their noise are as measured on real robots, as long
% as these constants have the values below. Other values change what was measured as much as they changed those models:
%
%   KIKS_SIM_PROX_NOISE     random part of each proximity reading [%]: the measured one is multiplied by it
%   KIKS_SIM_PROX_EMAX      error of small readings, a share: the measured one grows in proportion
%   KIKS_SIM_PROX_EMIN      error of readings of 1000: likewise
%   KIKS_SIM_PROX_EEXP      the larger, the less frequent large errors are; with 1, all are equally frequent
%   KIKS_SIM_LIGHT_FEXP     the larger, the wider is the field of view of the light sensors
%   KIKS_K213_NOISE         random part of each pixel of the camera [%]
%   KIKS_K213_NONORMALIZE   with a value other than [], the camera's shutter is fixed: a dark scene gives a dark picture
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

% Without effect: balls, cylinders and the range of sensors have the sizes of real ones.
KIKS_OBJECT_BALL_RADIUS = [];
KIKS_ROUNDOBJECT_RADIUS = [];
KIKS_SIM_PROX_DIST = [];

% Without effect: KiKS 2.2.0 used these for itself.
KIKS_K213_2DMODE = [];
KIKS_SETTINGS_DIR = '';

% The most points of a path (kiks_siminfo_robotpath). At first there are 25 a second. When there are more than this,
% every second point is dropped, and from then on half as many come.
KIKS_TRACE_MAX = 8^5;

% The film that the next kiks_kopen begins and kiks_kclose ends (see kiks_recordmovie); '' for none.
KIKS_MOVIENAME = '';

% Without effect: films are H.264, in a quality of their own.
KIKS_MOVIE_COMPRESSION = 'Indeo5';
KIKS_MOVIE_QUALITY = 50;
