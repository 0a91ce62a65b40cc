"""Every conversion between the robot's units and ours: here, and nowhere else.

Inside KiKS lengths are mm, times s (or whole ns on the clock), angles rad, wheel paths encoder pulses.
"""

from __future__ import annotations

TICK_NS = 10_000_000
"""Period of the robot's own control loop [ns]: 10 ms (Khepera2 Programming Manual; khepera-protocol.md 6.1)."""

BITS_PER_CHARACTER = 11
"""Start bit, 8 data bits, 2 stop bits: the Khepera's (KiKS thesis, section 3.3: the factor 11)."""

BITS_MIN = 10
"""Fewest bits of a character: eight with a start bit and a stop bit."""

NS_PER_S = 1_000_000_000


def ns_from_s(time_s: float) -> int:
    """Return a time [s] as whole nanoseconds, rounded to the nearest."""
    return round(time_s * NS_PER_S)


def wait_ns(time_s: float) -> int:
    """Return how long a wait for some time [s] lasts [ns]: at least one, if it lasts at all.

    Who waits again and again for what is left up to an instant would else never get there.

    Example:
        >>> wait_ns(2.2e-16), wait_ns(0.0), wait_ns(0.07)
        (1, 0, 70000000)
    """
    return max(ns_from_s(time_s), 1 if time_s > 0 else 0)


def s_from_ns(time_ns: int) -> float:
    """Return a time [ns] in seconds."""
    return time_ns / NS_PER_S


def character_ns(baud: int, bits: int = BITS_PER_CHARACTER) -> int:
    """Return how long one character occupies the line [ns].

    Args:
        baud: Line speed [bit/s].
        bits: Bits that a character takes with its start and stop bits.

    Example:
        >>> character_ns(9600), character_ns(115200, 10)
        (1145833, 86805)
    """
    return bits * NS_PER_S // baud


def clock_text(time_s: float) -> str:
    """Return a time [s] as the desk's clock shows it: minutes, seconds and complete hundredths.

    Example:
        >>> clock_text(83.456)
        '1:23.45'
    """
    # Rounding errors may put a time just below a hundredth.
    hundredths = int(time_s * 100 + 1e-6)
    return f"{hundredths // 6000}:{hundredths // 100 % 60:02d}.{hundredths % 100:02d}"
