"""Whole Python programs, unchanged, in simulated time: their threads, clocks, ports and event loops."""
