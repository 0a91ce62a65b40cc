"""How the engine is compiled for tests in processes of their own: by variables of the environment that Numba reads."""

PLAIN_AND_CHECKED = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_BOUNDSCHECK": "1"}
"""For a processor without vectors to speak of, with every index checked: whoever needs either shares what is compiled,
for it takes minutes."""

MIDDLING = {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": ""}
"""For a processor with AVX2, where this one may have more."""
