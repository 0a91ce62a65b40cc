"""Films of recordings: the world from above with trails, and what a robot reads beside it."""
