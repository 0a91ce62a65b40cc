"""Drive robots with evolved controllers, until Ctrl-C: champions' files of `kiks evolve`, and after each its ports.

python examples/players/drive.py champion.toml /dev/ttyUSB0
python examples/players/drive.py predator.toml /dev/ttyUSB0 prey.toml /dev/ttyUSB1
kiks demo soccer examples/players/drive.py runs/football/left.toml kiks://1

`kiks run champion.toml` runs this program, too.
"""

import contextlib
import sys

import kiks

DAY_S = 86400.0

champions, ports = [], []
for word in sys.argv[1:]:
    if word.endswith(".toml"):
        champion = kiks.Champion.load(word)
    else:
        champions.append(champion)
        ports.append(word)
with contextlib.suppress(KeyboardInterrupt):
    kiks.drive(
        ports,
        [each.controller for each in champions],
        [list(each.parameters) for each in champions],
        seconds=DAY_S,
        period_s=champions[0].timing.period_s,
        baud=champions[0].baud,
    )
