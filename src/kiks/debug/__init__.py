"""The debugger: it stops a run, shows it, and goes back in it, as an editor or a page asks."""
