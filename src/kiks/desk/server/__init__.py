"""The web server of the desk: access control, frames, files, programs and the world."""
