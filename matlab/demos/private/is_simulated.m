function is = is_simulated(port)
% is_simulated  Tell whether a port is that of a simulated robot, for which a demo may make a world.

is = isnumeric(port) && port < 0;
end
