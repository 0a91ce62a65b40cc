function kiks_print(str)
% kiks_print  Show a line at once.
%
%   kiks_print(str) shows text on the console without delay, and in the log of the simulator's window.
%
%   Example:
%     kiks_print(sprintf('%d balls', 3))
%
%   See also kiks_status.

if nargin < 1
    str = '';
end
kiks_status(str, 1);
end
