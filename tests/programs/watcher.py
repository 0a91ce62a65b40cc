"""Only watches the clock. Argument: until when [s]."""

import sys
import time

looks = 0
while time.perf_counter() < float(sys.argv[1]):
    looks += 1
print(looks)
