"""Evolution and learning: tasks, executors, algorithms, champions and environments."""
