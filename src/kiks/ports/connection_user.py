"""Which user of this computer is at the other end of a connection."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

ESTABLISHED = "01"
"""State of an open connection in the system's list (include/net/tcp_states.h)."""

_CONNECTIONS = {socket.AF_INET: Path("/proc/net/tcp"), socket.AF_INET6: Path("/proc/net/tcp6")}
"""Where Linux lists connections and their owners (man 5 proc)."""

Address = tuple[str, int]


def connection_user(client: Address, server: Address) -> int | None:
    """Return the user number of a connection's other end; None if it is not on this computer, or closed.

    The system lists a closed end as user 0, so only an end that is open and belongs to a process counts.
    """
    try:
        family = socket.AF_INET6 if ":" in client[0] else socket.AF_INET
        ends = [_end(family, *client), _end(family, *server), ESTABLISHED]
        for line in _CONNECTIONS[family].read_text(encoding="ascii").splitlines()[1:]:
            words = line.split()
            if words[1:4] == ends and words[9] != "0":
                return int(words[7])
    except (OSError, ValueError, IndexError):
        pass
    return None


def _end(family: socket.AddressFamily, host: str, port: int) -> str:
    """Format an end of a connection as Linux lists it: address words in the processor's byte order, and the port."""
    raw = socket.inet_pton(family, host)
    words = (int.from_bytes(raw[k : k + 4], sys.byteorder) for k in range(0, len(raw), 4))
    return f"{''.join(f'{word:08X}' for word in words)}:{port:04X}"
