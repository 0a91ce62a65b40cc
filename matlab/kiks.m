function answer = kiks(arena, colormask)
% kiks  Start a session of the Khepera simulator KiKS.
%
%   kiks                     starts a session with the default arena, 500 x 650 mm with round corners
%   kiks(arena)              with an arena of yours: a matrix or the name of a file
%   kiks(arena, colormask)   with a matrix and the greys of its walls
%
%   A session is a world and the process that simulates it. If one is active, kiks says so and changes nothing:
%   kiks_arena changes the world, kiks_quit ends the session. After clear all, kiks begins a new world, unless other
%   programs take part in the session, and kiks_kopen opens a port that was left open: a program that begins with
%   clear all can be run again.
%
%   arena as a matrix: one element is 1 mm x 1 mm, rows are y (down), columns are x (to the right); at least
%   100 x 100, else there is a warning and the default arena. Its elements:
%
%      < 0   start pose of a robot; the absolute value is its heading [degrees, 0 right, 90 up], -360 for 0
%        0   floor
%        1   wall                (so is what is larger than 4; so are fractions: 0.5 is a wall half as bright as white)
%        2   light
%        3   ball
%        4   cylinder
%
%   Each start pose gets a robot. A robot, ball or cylinder without room at its place gets the nearest place with room,
%   and a warning says so. Old programs of the thesis's coding (2 ball, 3 light): KIKS_ARENA_CODING in
%   kiks_preferences.
%
%   arena as a file: .kad, a picture (.tif .png .bmp .pgm .pbm .ppm), an arena file .toml or a project .kiks, with or
%   without its ending. What is not in the current folder is looked for beside the running program, on the path, and
%   among the arenas that come with KiKS: kiks('maze'). If nothing has a name without ending, there is a warning and the
%   default arena.
%
%   colormask: a matrix of arena's size, the brightness of walls, 1 black to 255 white; where it is left out, walls have
%   KIKS_ARENA_DEFAULT_COLOR. It is ignored with files, which have greys of their own.
%
%   kiks('--join')           takes part in the newest session on this computer that another Octave or MATLAB started
%   kiks('--join', number)   in the session with that number
%   kiks('--version')        prints the version; returns it if an output is wanted: 'KiKS 3.0.0'
%   kiks('--state')          prints or returns 16 digits that two equal runs agree on, to the last bit
%   kiks('--help')           shows this
%
%   Settings (seed, robot, thinking time and so on) are in kiks_preferences.
%
%   Example:
%     arena = zeros(300, 400); arena(150, 200) = -90; arena(150, 300) = 3;
%     kiks(arena), kiks_siminfo_robotpos, kiks_quit
%
%   See also kiks_arena, kiks_quit, kiks_kopen, kiks_preferences, kiks_load.

if nargin < 1
    arena = [];
end
if nargin < 2
    colormask = [];
end
arena = plain_text(arena);
if nargout > 0
    answer = '';
end
if ischar(arena) && strncmp(arena, '--', 2)
    switch arena
        case '--version'
            version_text = version_line();
            disp(version_text);
            if nargout > 0
                answer = version_text;
            end
        case '--state'
            need_session('kiks(''--state'')');
            answer = simulator('state');
            if nargout == 0
                disp(answer);
                clear answer;
            end
        case '--help'
            help('kiks');
        case '--join'
            join_session(plain_text(colormask));
        otherwise
            error('kiks:argument', ['The option must be --join, --version, --state or --help, but it was %s. ' ...
                'Give an arena, or nothing for the default one.'], arena);
    end
elseif is_active() && (~isempty(global_value('KIKS_SESSIONACTIVE')) || is_shared())
    kiks_status(['A session is active, so kiks changed nothing. kiks_arena(ARENA) changes the world, ' ...
        'kiks_quit ends the session.'], 1);
else
    begin_world(arena, colormask);
end
end

function text = version_line()
was_running = simulator('--is-running', []);
prepare_process();
text = ['KiKS ' simulator('version')];
if ~was_running
    simulator('--end', []);
end
end

function join_session(number)
if isempty(number)
    number = 0;
elseif ischar(number)
    number = str2double(number);
end
if ~isnumeric(number) || ~isscalar(number) || ~isfinite(number) || number < 0 || number ~= fix(number)
    error('kiks:argument', ['The session''s number must be whole and not negative, but it was %s. ' ...
        'Leave it out for the newest session. For a robot on another computer, say kiks run --join ADDRESS ' ...
        'PROGRAM in a shell.'], shown(number));
end
simulator('--join', number);
simulator(own_turrets('find'));
pulse_mm('forget');
global_value('KIKS_SESSIONACTIVE', 1);
kiks_status('Joined the session. kiks_quit leaves it.', 1);
if is_octave() || ~isempty(simulator('desk'))
    poll_desk('begin');
end
end
