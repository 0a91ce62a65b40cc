"""The desk: a world in a browser."""
