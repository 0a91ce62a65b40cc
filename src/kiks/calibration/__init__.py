"""Calibration: the constants of one robot, measured over its line and fitted by simulation."""
