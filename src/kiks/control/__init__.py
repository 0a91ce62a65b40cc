"""Controllers, which map readings to speeds, and measures of their performance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, ["controllers", "measures"])
