function session_clocks(are_simulated)
% session_clocks  Let time, clock, now, cputime, tic, toc and pause be those of the folder clocks, or no longer.

folder = fullfile(fileparts(fileparts(mfilename('fullpath'))), 'clocks');
if any(strcmp(strsplit(path(), pathsep()), folder))
    if ~are_simulated
        rmpath(folder);
    end
elseif are_simulated
    try
        passed_s = builtin('toc');
        simulator(sprintf('tic %.6f', passed_s));
    catch
        % tic was not called.
    end
    before = warning('off', 'all');  % they have names of functions that there are
    addpath(folder);
    warning(before);
end
end
