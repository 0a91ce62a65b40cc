function seconds = toc(id)
% toc  Tell the program's time since tic [s], see kiks_clock.
%
%   toc(id) is the time since id = tic().

passed_s = [];
if nargin == 0
    passed_s = kiks_clock('toc') / 1e6;
elseif isa(id, 'uint64') && isscalar(id)
    passed_s = (kiks_clock('clock') - double(id)) / 1e6;
end
if isempty(passed_s) || passed_s > 1e9
    % There is no session, or id is of MATLAB's own counter, or something is wrong, which its function says.
    if nargin == 0
        passed_s = builtin('toc');
    else
        passed_s = builtin('toc', id);
    end
end
if nargout > 0
    seconds = passed_s;
else
    fprintf('Elapsed time is %g seconds\n', passed_s);
end
end
