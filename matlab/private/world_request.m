function request = world_request(arena, colormask, preferences)
% world_request  Turn the arena argument of kiks into a request for a world.

if isempty(arena)
    request = 'world default';
elseif ischar(arena)
    request = file_request(arena);
else
    [codes, greys] = checked_codes(arena);
    if any(size(codes) < 100)
        warn('kiks:argument', ['An arena must be at least 100 x 100 mm, but this matrix is %d x %d. ' ...
            'The default arena is taken instead.'], size(codes, 1), size(codes, 2));
        request = 'world default';
        return
    end
    if strcmp(preferences.KIKS_ARENA_CODING, 'thesis')
        codes = swapped(codes);
    end
    request = ['world matrix ' matrix_text(codes)];
    if ~isempty(colormask)
        greys = wall_greys(codes, colormask);
    end
    if ~isempty(greys)
        request = [request ' ' matrix_text(greys)];
    end
end
end

function request = file_request(name)
try
    request = ['world file ' escaped(arena_file(name))];
catch failure
    [~, ~, ending] = fileparts(name);
    if ~isempty(ending)
        rethrow(failure);
    end
    % Programs for KiKS 2.2.0, which did not know names without ending, count on going on.
    warn('kiks:argument', '%s The default arena is taken instead.', failure.message);
    request = 'world default';
end
end

function [codes, greys] = checked_codes(arena)
% Codes of the elements, and what they say about the greys of walls, 0 for the default; [] if they say nothing.
if ~(isnumeric(arena) || islogical(arena)) || ndims(arena) ~= 2 || ~isreal(arena)
    error('kiks:argument', ['The arena must be a matrix of element codes or the name of a file, but it was %s. ' ...
        'See help kiks.'], shown(arena));
end
codes = full(double(arena));
wrong = find(~isfinite(codes), 1);
if ~isempty(wrong)
    [row, column] = ind2sub(size(codes), wrong);
    error('kiks:argument', ['An arena''s elements must be headings below 0, the codes 0 to 4 or shares of white, ' ...
        'but that in row %d, column %d was %g. Give walls as 1.'], row, column, codes(wrong));
end
greys = [];
% Of pictures that were divided by 255, KiKS 2.2.0 made walls of these greys.
shares = codes > 0 & codes ~= fix(codes);
if any(shares(:))
    greys = max(round(255 * min(codes, 1)), 1) .* shares;
end
codes(codes > 4 | shares) = 1;
end

function codes = swapped(codes)
lights = codes == 3;
codes(codes == 2) = 3;
codes(lights) = 2;
end

function greys = wall_greys(codes, colormask)
if ~(isnumeric(colormask) || islogical(colormask)) || ~isequal(size(colormask), size(codes))
    error('kiks:argument', ['The colormask must be a matrix as large as the arena, %d x %d, but it was %s. ' ...
        'Leave it out for walls of KIKS_ARENA_DEFAULT_COLOR.'], size(codes, 1), size(codes, 2), shown(colormask));
end
greys = full(double(colormask));
if any(~isfinite(greys(:))) || any(greys(:) < 0) || any(greys(:) > 255)
    error('kiks:argument', ['The colormask''s elements must be from 0 to 255, but they are from %g to %g. ' ...
        '1 is a black wall, 255 a white one.'], min(greys(:)), max(greys(:)));
end
% A wall of grey 0 counts as the darkest wall.
greys = max(round(greys), 1) .* (codes == 1);
end
