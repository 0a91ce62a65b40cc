function stop_robot(ref)
% stop_robot  Stop a robot at the end of a program, whatever has ended it.

try
    kSetSpeed(ref, 0, 0);
catch
    % The connection may be what has failed; its message has been shown already.
end
end
