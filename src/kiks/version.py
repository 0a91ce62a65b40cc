"""The version of KiKS, which files and other computers are compared with, and the versions of Python that it knows."""

import sys

__version__ = "3.0.0"

PYTHONS = (3, 11), (3, 15)
"""The oldest and the newest Python that Numba and KiKS know, as in `pyproject.toml`."""

if not PYTHONS[0] <= sys.version_info[:2] <= PYTHONS[1]:
    # A traceback would say less, for instance that Numba is not there.
    oldest, newest, here = (f"{major}.{minor}" for major, minor in (*PYTHONS, sys.version_info[:2]))
    sys.exit(f"kiks: Python must be {oldest} to {newest}, but this is {here}. Install KiKS for another one.")
