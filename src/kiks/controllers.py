"""Another name of `kiks.control.controllers`, so that `import kiks.controllers` works as `kiks.controllers` does."""

import sys

from kiks.control import controllers
from kiks.control.controllers import *  # noqa: F403  (what type checkers see)

sys.modules[__name__] = controllers
