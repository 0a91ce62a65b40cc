function shared = is_shared()
% is_shared  Tell whether other programs take part in the session.

shared = false;
try
    shared = str2double(simulator('clients')) > 1;
catch failure
    % A process that has ended has no programs.
    if ~strcmp(failure.identifier, 'kiks:session')
        rethrow(failure);
    end
end
end
