function index = cpu_index(computer_name)
% cpu_index  Return the speed index of a computer: of a name in the table, or the number that was given.
%
%   The larger, the slower; kiks_speedtest measures that of this computer. Source: kiks-behaviour.md, section 7.4.

names = {'143 MHz UltraSPARC', '300 MHz Celeron-A', '300 MHz UltraSPARC-II', '450 MHz Celeron-A', ...
    '733 MHz Pentium III', '900 MHz Celeron II', '800 MHz Pentium III EB', '1 GHz Pentium III', '1.2 GHz Athlon', ...
    '1.4 GHz Athlon'};
indexes = [20.33 15.11 10.25 10.01 5.87 5.70 5.47 4.39 3.27 3.18];
if isnumeric(computer_name)
    index = computer_name;
    return
end
plain = @(text) lower(strrep(strrep(text, ' ', ''), '_', ''));
found = strcmp(plain(computer_name), cellfun(plain, names, 'UniformOutput', false));
if ~any(found)
    error('kiks:argument', ['KIKS_EMULATED_CPU must be an index or one of:%s, but it was %s. ' ...
        'Copy a name from the list.'], sprintf(' ''%s''', names{:}), shown(computer_name));
end
index = indexes(found);
end
