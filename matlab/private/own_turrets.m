function result = own_turrets(what, order)
% own_turrets  The user's turrets: functions in the folder turrets of the current folder.
%
%   A turret is a function that returns its number, 1 to 99, without an argument. With two, the letter of an order and a
%   row of numbers, it returns the robot's reply as a text, such as 't,24,c,90'.
%
%   request = own_turrets('find')         looks for them; returns the request that tells the simulator of them
%   request = own_turrets('call', order)  calls the function for an order, such as '1 T,24,C'; 1 stands for port -1.
%                                         Returns the request with order and reply
%   numbers = own_turrets('numbers')      the numbers of those that were found

persistent turrets
if isempty(turrets)
    turrets = struct('number', {}, 'name', {});
end
switch what
    case 'find'
        turrets = found();
        words = arrayfun(@(each) sprintf(' %d %s', each.number, each.name), turrets, 'UniformOutput', false);
        result = ['turrets' words{:}];
    case 'call'
        [port, text] = strtok(order, ' ');
        text = unescaped(text(2:end));
        words = regexp(text, ',', 'split');
        turret = turrets([turrets.number] == str2double(words{2}));
        result = ['order ' port ' ' escaped([text char(10) reply_of(turret, words{3}, words(4:end))])];
    case 'numbers'
        result = [turrets.number];
end
end

function turrets = found()
turrets = struct('number', {}, 'name', {});
folder = fullfile(pwd(), 'turrets');
% Those of KiKS 2.2.0 need its variables, and are built in.
files = setdiff(file_names(folder), {'kiks_turret_k213.m', 'kiks_turret_radio.m', 'kiks_turret_battle.m'});
if ~isempty(files)
    % They win over functions of the same name, without a warning.
    before = warning('off', 'Octave:shadowed-function');
    addpath(folder);
    warning(before);
end
for k = 1:numel(files)
    [~, name] = fileparts(files{k});
    try
        number = feval(name);
    catch failure
        say_once(name, sprintf('turrets/%s must return its number, but it failed: %s', files{k}, ...
            one_line(failure.message)));
        continue
    end
    is_number = isnumeric(number) && isscalar(number) && any(number == 1:99);
    if ~is_number || any([turrets.number] == number)
        say_once(name, sprintf(['turrets/%s must return a number of its own from 1 to 99 when it is called without ' ...
            'an argument, but that was %s. It is left out.'], files{k}, shown(number)));
        continue
    end
    turrets(end + 1) = struct('number', double(number), 'name', name); %#ok<AGROW>
end
end

function names = file_names(folder)
names = {};
if exist(folder, 'dir') == 7
    listed = dir(fullfile(folder, '*.m'));
    names = {listed.name};
end
end

function reply = reply_of(turret, letter, words)
reply = 'z,Turret order not supported';
numbers = [];
if ~isempty(words)
    numbers = str2double(words);
end
try
    answer = plain_text(feval(turret.name, strtrim(letter), numbers));
    if ~ischar(answer) || size(answer, 1) > 1 || any(answer == 10 | answer == 13)
        error('it must return a row of characters without a line end, but it was %s', shown(answer));
    end
    reply = answer;
catch failure
    why = one_line(failure.message);
    say_once([turret.name why], sprintf('turrets/%s.m could not carry out order %s: %s', turret.name, letter, why));
end
end
