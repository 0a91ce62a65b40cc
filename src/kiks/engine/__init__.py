"""Arrays in, arrays out: motors, motion, contact, rays and sensors. No clock, no input or output, no own randomness."""
