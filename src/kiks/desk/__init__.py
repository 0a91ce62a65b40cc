"""The desk: a browser's view of the simulation."""
