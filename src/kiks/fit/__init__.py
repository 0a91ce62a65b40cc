"""From measured samples to the sensors' response: readers of samples, and the fit."""
