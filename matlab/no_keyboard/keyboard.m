function keyboard(varargin)
% keyboard  Refuse to stop without a keyboard: Octave would ask for ever (private/run_program.m).

error('kiks:keyboard', ['keyboard must have a keyboard to read from, but this program has none. To stop in the ' ...
    'debugger, run it in a terminal: kiks run PROGRAM.']);
end
