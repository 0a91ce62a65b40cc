"""The campaigns of `tools/torture.py`, one file a subject."""
