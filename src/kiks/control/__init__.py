"""Controllers, which map readings to speeds, and measures of their performance."""
