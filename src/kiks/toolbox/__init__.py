"""The simulator's side of the toolbox for Octave and MATLAB, `matlab/`: a world, and who asks for things in it."""
