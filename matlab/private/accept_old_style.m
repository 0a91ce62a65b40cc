function accept_old_style()
% accept_old_style  Let Octave take what programs for old versions of MATLAB write.
%
%   They write ['N' 10], and if a | b, in each loop, of which Octave would warn. And they write kMatlab's functions with
%   other capitals, ksetspeed or KSetSpeed: those versions, and kMatlab, did not distinguish them.

if is_octave()
    warning('off', 'Octave:num-to-str');
    warning('off', 'Octave:possible-matlab-short-circuit-operator');
    accept_spellings();
end
end

function accept_spellings()
if exist('kstop') %#ok<EXIST> % They are there: no program of this name is in a toolbox.
    return
end
files = dir(fullfile(fileparts(fileparts(mfilename('fullpath'))), 'k*.m'));
for k = 1:numel(files)
    name = files(k).name(1:end - 2);
    if ~strncmp(name, 'kiks', 4)
        others = {lower(name), ['K' name(2:end)], ['K' lower(name(2:end))], ['k' upper(name(2)) lower(name(3:end))]};
        for other = unique(others)
            accept_spelling(name, other{1});
        end
    end
end
end

function accept_spelling(name, other)
% A program's own function of that name stays.
if exist(other) %#ok<EXIST>
    return
end
% Without an output asked for, the reply is still printed as ans.
eval(sprintf(['function varargout = %s(varargin)\n' ...
    '[varargout{1:max(nargout, min(abs(nargout(''%s'')), 1))}] = %s(varargin{:});\nend'], other, name, name));
end
