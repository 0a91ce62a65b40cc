"""The web server of the desk: access, frames for browsers, files, and the world they share."""
