function leave(ref)
% leave  Stop the robot and close its port, at the end of a demo and after Ctrl-C.

kSetSpeed(ref, 0, 0);
kiks_kclose(ref);
end
