"""For programs that drive a robot, simulated or real alike: they know a port, never the simulation."""
