% run_program  Run the program of Octave that KIKS_PROGRAM names in a world that is there already.
%
%   KiKS starts this script (src/kiks/toolbox/octave_program.py). KIKS_PIPES has the two ends of its pipes, and
%   KIKS_CHANCE the numbers from which all random numbers follow.

page_screen_output(false);
page_output_immediately(true);
warning('off', 'Octave:function-name-clash');  % a file of a function that was handed in has any name
addpath(fileparts(fileparts(mfilename('fullpath'))));
addpath(fileparts(getenv('KIKS_PROGRAM')));
for generator = {@rand, @randn, @rande, @randg, @randp}
    generator{1}('twister', sscanf(getenv('KIKS_CHANCE'), '%d'));
end
kiks_nothing = stat('/dev/null');
if ~isempty(kiks_nothing) && isequal(stat(stdin).rdev, kiks_nothing.rdev)
    before = warning('off', 'all');  % they have names of functions that there are
    addpath(fullfile(fileparts(fileparts(mfilename('fullpath'))), 'no_keyboard'));
    warning(before);
end
evalc('kiks(''--join'')');
clear generator before kiks_nothing;
try
    source(getenv('KIKS_PROGRAM'));
    % A file that begins with a function which nothing in it calls is called, as by the button Run of MATLAB.
    kiks_text = fileread(getenv('KIKS_PROGRAM'));
    kiks_text(kiks_text > 127) = ' ';  % in any encoding
    kiks_text = regexprep(kiks_text, '[%#][^\n]*', '');
    kiks_first = regexp(kiks_text, '^\W*function\s+(?:[^=(\n]*=)?\s*(\w+)', 'tokens', 'once');
    if ~isempty(kiks_first) && numel(regexp(kiks_text, ['\<' kiks_first{1} '\>'])) == 1
        feval(kiks_first{1});
    end
catch kiks_failure
    % Like Python, the places from the outermost on, and the message in the last line.
    kiks_toolbox = fileparts(fileparts(mfilename('fullpath')));
    for place = kiks_failure.stack(end:-1:1)'
        if ~strncmp(place.file, kiks_toolbox, numel(kiks_toolbox))
            [~, name, ending] = fileparts(place.file);
            fprintf(stderr, '  %s%s, line %d, in %s\n', name, ending, place.line, place.name);
        end
    end
    [first, rest] = strtok(kiks_failure.message, char(10));
    if ~isempty(rest)
        fprintf(stderr, '%s\n', strtrim(rest));
    end
    fprintf(stderr, 'error: %s\n', first);
    exit(1);
end
