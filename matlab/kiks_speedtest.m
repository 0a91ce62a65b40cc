function index = kiks_speedtest(n)
% kiks_speedtest  Measure how fast this computer is: the computer speed index.
%
%   index = kiks_speedtest(n) does a fixed piece of work n times (4) and returns the processor seconds of the fastest:
%   the smaller, the faster. The work is a mixture of small matrices and a loop, as in programs for robots. A present
%   computer has 0.1 to 0.5; on the scale of KiKS 2.2.0, which is used here, a PC of 2001 has about 4 (1 GHz
%   Pentium III: 4.39). How well the scales agree is an estimate, so factors between indexes are good to a factor of
%   two.
%
%   KIKS_EMULATED_CPU in kiks_preferences uses it: then a program thinks as slowly as on that computer.
%
%   Example:
%     kiks_speedtest(1)
%
%   See also kiks_calibrate, kiks_preferences.

if nargin < 1 || isempty(n)
    n = 4;
end
check_whole('The number of repetitions', n, 1, 1000, 'Call kiks_speedtest(4).');
index = Inf;
for k = 1:n
    begin = builtin('cputime');
    work();
    index = min(index, builtin('cputime') - begin);
end
% A coarse clock may measure 0.
index = max(index, 0.001);
end

function total = work()
% Matrices small enough for the cache and for a single thread.
total = 0;
values = reshape(sin(1:1024), 32, 32);
row = cos(1:4096);
for k = 1:2000
    product = values * values';
    total = total + sum(sqrt(abs(product(:)))) + max(sort(row)) + sum(exp(-row.^2));
end
for k = 1:20000
    total = total + mod(k, 7) * 0.5;
end
end
