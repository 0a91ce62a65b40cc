function stop_robot(ref)
% stop_robot  Stop a robot at the end of a program, also after an error or Ctrl-C.

try
    kSetSpeed(ref, 0, 0);
catch
    % The connection itself may have failed; its message was shown already.
end
end
