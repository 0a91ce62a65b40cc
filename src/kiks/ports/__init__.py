"""Ways to a simulated robot: bytes and nothing else."""
