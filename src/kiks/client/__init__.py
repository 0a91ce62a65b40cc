"""For programs that drive a robot, simulated or real: they know its port, never the simulation."""
