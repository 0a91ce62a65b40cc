"""Another name of `kiks.control.measures`, so that `import kiks.measures` works as `kiks.measures` does."""

import sys

from kiks.control import measures
from kiks.control.measures import *  # noqa: F403  (what type checkers see)

sys.modules[__name__] = measures
