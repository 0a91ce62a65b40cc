"""A soccer player that was evolved by `kiks evolve football`.

python examples/players/evolved.py /dev/ttyUSB0 left kiks-evolve-football
kiks demo soccer --left "examples/players/evolved.py kiks-evolve-football"
"""

import sys
from pathlib import Path

import kiks

DAY_S = 86400.0

port, side, folder = sys.argv[1:]
kiks.Champion.load(Path(folder) / f"{side}.toml").drive(port, seconds=DAY_S)
