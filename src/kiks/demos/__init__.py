"""Whole programs for a Khepera, real or simulated: `python -m kiks.demos.avoid /dev/ttyUSB0`, or `kiks demo avoid`."""
