"""A program elsewhere, which drives one robot of a world."""

from __future__ import annotations

from kiks.ports.socket_participant import SocketParticipant


class Player(SocketParticipant):
    """A program elsewhere; a lost one, and one that is dismissed, leaves its robot standing."""

    _farewell = ""

    @property
    def farewell(self) -> str:
        """Why the connection was ended, as a sentence for its user; empty if the program has left by itself."""
        return f"The program {self.reason}." if self.reason else self._farewell

    @property
    def state(self) -> str:
        """What it does, as the rest of a sentence about it."""
        if self.has_left:
            return "was lost or disconnected" if self.is_stopped or self.reason else "has ended"
        if self.is_here:
            return "drives" if self._scheduler.has_begun else "is ready"
        return "has come"

    def dismiss(self, why: str) -> None:
        """Disconnect the program at once: its robot stops and is free. Needs the lock of the world.

        Args:
            why: For its user.
        """
        if not self.has_left:
            self._farewell = why
        self.is_stopped = True
        self.disconnect()
        self.expel()

    def drop(self) -> None:
        """Disconnect the program, because it was silent for too long."""
        self.end_because("was silent while others waited")
