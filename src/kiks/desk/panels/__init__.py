"""The panels of the desk's page, made of NiceGUI elements."""
