function kiks_kiksnet(password)
% kiks_kiksnet  Has nothing to do any more: worlds are shared without a server.
%
%   kiks_kiksnet(password) says that and returns, so that old programs run. To let several programs drive in one world,
%   start a session with kiks and an arena with a start pose for each; in each further Octave or MATLAB on this computer
%   call kiks('--join').
%
%   Example:
%     kiks_kiksnet
%
%   See also kiks.

disp('kiks_kiksnet: no server is needed. kiks(''--join'') in another Octave or MATLAB takes part in this world.');
end
