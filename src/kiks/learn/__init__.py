"""Evolution and learning: what is evaluated, where it is evaluated, and what comes of it."""
