function list = kiks_demo(demo, varargin)
% kiks_demo  List the demos, or start one.
%
%   kiks_demo prints the demos, each with its number and what it does.
%   kiks_demo(demo) starts the one of that name or number. Further arguments are the demo's own: port, baud, seconds.
%   list = kiks_demo() returns the names as a column of cells.
%
%   Example:
%     kiks_demo('follow', -1, 9600, 20)
%
%   See also kiks, follow, avoid.

folder = fullfile(fileparts(mfilename('fullpath')), 'demos');
files = dir(fullfile(folder, '*.m'));
names = sort(strrep({files.name}', '.m', ''));
if nargin < 1
    if nargout > 0
        list = names;
        return
    end
    for k = 1:numel(names)
        fprintf('%3d  %s\n', k, first_line(fullfile(folder, [names{k} '.m'])));
    end
    fprintf('kiks_demo(''follow'') starts one, help follow tells more.\n');
    return
end
demo = plain_text(demo);
if isnumeric(demo) && isscalar(demo) && any(demo == 1:numel(names))
    demo = names{demo};
elseif ~ischar(demo) || ~any(strcmp(demo, names))
    error('kiks:argument', ['The demo must be a number from 1 to %d or one of%s, but it was %s. ' ...
        'Call kiks_demo(''follow'').'], numel(names), sprintf(' %s', names{:}), shown(demo));
end
addpath(folder);
feval(demo, varargin{:});
end

function line = first_line(file)
% '% follow  Demo: follow the wall on the left.' becomes 'follow    follow the wall on the left.'
words = regexp(fileread(file), '^%\s*(\w+)\s+Demo:\s*([^\r\n]*)', 'tokens', 'once', 'lineanchors');
line = sprintf('%-9s %s', words{1}, words{2});
end
