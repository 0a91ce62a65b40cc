function kiks_setup()
% kiks_setup  Put the toolbox on the path.
%
%   kiks_setup adds the toolbox's folder and that of the demos to the path of this session. To keep it, call savepath
%   after it, or write addpath('FOLDER') with the toolbox's folder into .octaverc or startup.m. KiKS needs nothing else.
%
%   A calibration is optional: to give the simulator the latency of a real robot's line, measure it with
%   kiks_calibrate.
%
%   Example:
%     kiks_setup
%
%   See also kiks_calibrate, kiks_preferences.

folder = fileparts(mfilename('fullpath'));
demos = fullfile(folder, 'demos');
addpath(folder);
if exist(demos, 'dir')
    addpath(demos);
end
fprintf('%s is on the path. Call savepath to keep it there.\n', folder);
fprintf('kiks starts a session. kiks_calibrate measures this computer and a real robot''s line, if you want that.\n');
end
