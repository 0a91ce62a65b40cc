"""From measured samples to the sensors' response: readers, training, and the card that tells how good it is."""
