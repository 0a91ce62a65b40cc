"""The page of the desk: its panels, as NiceGUI elements."""
