"""The simulator's side of the toolbox for Octave and MATLAB (`matlab/`): sessions, their clients and requests."""
