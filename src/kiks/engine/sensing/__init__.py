"""Rays, and the proximity, light, range and camera sensors that use them."""
