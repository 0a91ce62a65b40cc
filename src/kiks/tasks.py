"""Another name of `kiks.learn.tasks`, so that `import kiks.tasks` works as `kiks.tasks` does."""

import sys

from kiks.learn import tasks
from kiks.learn.tasks import *  # noqa: F403  (what type checkers see)

sys.modules[__name__] = tasks
