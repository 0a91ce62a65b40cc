"""What decides in a batch: controllers, from readings to speeds, and measures of how well they do."""
