"""The way of a program to a world of this process that it shares with others, each of which has a thread of its own.

Whoever needs an answer moves the world as far as it may go; only if somebody else has to act first does it wait.
"""

from __future__ import annotations

from kiks.errors import LinkError
from kiks.ports.far import Connection
from kiks.ports.messages import Answer, Kind, Request
from kiks.ports.programs import Programs


class NearConnection(Connection):
    """A program's way to a world of this process; `close` ends it.

    Args:
        programs: Those who share the world.
        name: Who it is, for a person.
        rank: Its place among those who act at the same instant.

    Raises:
        KiksError: If the world has ended.
    """

    def __init__(self, programs: Programs, name: str, rank: int) -> None:
        super().__init__(is_late=True)
        self._programs = programs
        self._world = programs.sim.lock
        self._guest = programs.admit(name, rank)
        self._is_resting = False

    def _say(self, request: Request) -> None:
        with self._world:
            # Who was given up because it said nothing counts again.
            self._guest.is_waited_for = not self._is_resting
            self._guest.hear(request)
            # Others may have waited for nothing but this.
            if self._programs.is_shared and request.kind is Kind.REACHED:
                self._programs.move()

    def _wait(self, ticket: int) -> Answer:
        guest, programs = self._guest, self._programs
        with self._world:
            while (answer := guest.answer) is None or answer.ticket != ticket:
                if guest.is_closed:
                    raise LinkError("the world must be there to answer, but it has ended. Open the port again.")
                wait_s = programs.move()
                if guest.answer is None or guest.answer.ticket != ticket:
                    programs.wait(wait_s)
        return answer

    def rest(self) -> None:
        """Let the others go on without this program, until `wake`; what was said is still done."""
        self._is_resting = True
        with self._world:
            self._guest.is_waited_for = False
            self._programs.move()
        # Its time begins again when it next needs the world.
        self._is_to_meet = True

    def wake(self) -> None:
        """Be one of those again whom the world waits for."""
        self._is_resting = False

    def close(self) -> None:
        """Leave; what was said is still done."""
        with self._world:
            self._guest.leave()
            self._programs.move()
