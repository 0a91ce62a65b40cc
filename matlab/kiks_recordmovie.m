function kiks_recordmovie(name)
% kiks_recordmovie  Make a film of the world.
%
%   kiks_recordmovie(name) films the world from the next kiks_kopen of a simulated port on, until kiks_kclose closes
%   that port. The film shows the world from above, and beside it what the robot of the port reads. It is an MP4
%   (H.264), in real time; a name that ends in .gif or .webp gives that instead. An existing file is replaced.
%
%   kiks_recordmovie('') takes that back. A program may also set the global variable KIKS_MOVIENAME to the name, or
%   kiks_preferences may, to film each time.
%
%   Example:
%     kiks_recordmovie('run'), ref = kiks_kopen; kSetSpeed(ref, 5, 5), kiks_pause(2), kiks_kclose(ref)
%
%   See also kiks_kopen, kiks_kclose.

if nargin < 1
    error('kiks:argument', 'kiks_recordmovie needs the name of a film. Call kiks_recordmovie(''run.mp4'').');
end
name = plain_text(name);
if ~ischar(name) || size(name, 1) > 1
    error('kiks:argument', ['The film''s name must be a text, but it was %s. Call kiks_recordmovie(''run.mp4'').'], ...
        shown(name));
end
global KIKS_MOVIENAME
KIKS_MOVIENAME = name;
end
