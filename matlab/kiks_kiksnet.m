function kiks_kiksnet(password)
% kiks_kiksnet  Has nothing to do any more: the command kiks host in a shell is the server.
%
%   kiks_kiksnet(password) says that and returns, so that old programs run. A program on another computer drives a
%   robot of that server by the command kiks run --join ADDRESS program.m. To let several programs of this computer
%   drive in one world, start a session with kiks and an arena with a start pose for each; in each further Octave or
%   MATLAB call kiks('--join').
%
%   Example:
%     kiks_kiksnet
%
%   See also kiks.

disp(['kiks_kiksnet: kiks host in a shell is the server for other computers. On this one none is needed: ' ...
    'kiks(''--join'') in another Octave or MATLAB takes part in this world.']);
end
