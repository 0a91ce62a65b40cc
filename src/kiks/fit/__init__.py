"""From readings of a real robot to a simulated one like it: samples, how a robot collects its own, and the fit."""
