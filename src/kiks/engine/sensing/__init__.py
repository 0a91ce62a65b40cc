"""What sensors measure: rays, and the proximity, light, range and camera sensors made of them."""
