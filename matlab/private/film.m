function film(what, number, name)
% film  The film that kiks_recordmovie has asked for.
%
%   film('begin', number, name)  films from now on if there is a name and no film is made; number: port's
%   film('save', number)         ends the film that began with this port, 0: with any, and makes its file
%   film('forget', number)       the simulator's process has ended, and its film with it

persistent port file
switch what
    case 'begin'
        if isempty(port) && ~isempty(name)
            file = movie_file(name);
            simulator(sprintf('film %d %s', number, escaped(file)));
            port = number;
        end
    case 'save'
        if ~isempty(port) && any(number == [0 port])
            port = [];
            global KIKS_MOVIENAME
            KIKS_MOVIENAME = '';
            try
                count = str2double(simulator('film_save'));
                kiks_status(sprintf('kiks_recordmovie: %d pictures are in %s', count, file), 1);
            catch failure
                kiks_status(['kiks_recordmovie: ' one_line(failure.message)], 1);
            end
        end
    case 'forget'
        port = [];
end
end

function file = movie_file(name)
% The file of a name: films are MP4 unless the name asks for another kind that there is.
[folder, stem, ending] = fileparts(name);
if ~any(strcmpi(ending, {'.mp4', '.gif', '.webp'}))
    ending = '.mp4';
end
file = absolute_path(fullfile(folder, [stem ending]));
end
