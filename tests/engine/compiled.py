"""How the engine is compiled for tests in processes of their own: by variables of the environment that Numba reads."""

PLAIN_AND_CHECKED = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_BOUNDSCHECK": "1"}
"""For a processor without wide vectors, and with every index checked. Compiling takes minutes, so all tests that need
either one share this code."""

MIDDLING = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
"""For a processor with AVX2, where this one may have more."""
