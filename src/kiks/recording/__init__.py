"""Recordings of runs: written while a run goes on, read, replayed to the bit, and looked at."""
