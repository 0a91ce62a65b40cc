"""Adapters for libraries whose C code waits by itself, so that they wait in simulated time."""
