"""Evolution and learning: tasks, executors, algorithms, champions and environments."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["tasks"])
