"""The time limit of all waits of tests: only what hangs reaches it, however busy the computer is."""

GUARD_S = 100.0
