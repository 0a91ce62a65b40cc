"""A client of a session: one Octave or MATLAB with its open ports and its simulated time."""

from __future__ import annotations

import logging
import math
import re
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from kiks.clock.program_clock import ProgramClock
from kiks.errors import KiksError, LinkError, ParameterError
from kiks.model.arena import Arena
from kiks.ports.link import Link, RemoteLine
from kiks.ports.messages import AwaitedAnswer, Verb
from kiks.ports.thread_link import ThreadLink
from kiks.sim.port import VirtualPort
from kiks.sim.simulation import Simulation
from kiks.toolbox.own_turrets import OwnTurret, TurretOrder, addressed_turret
from kiks.toolbox.session import Session
from kiks.toolbox.session_clock import SessionClock
from kiks.toolbox.session_film import SessionFilm
from kiks.toolbox.wire_format import escape
from kiks.units import NS_PER_S, s_from_ns

ANSWER_S = 10.0
"""Timeout of a reply [s of simulated time]: a camera picture at 300 baud takes that."""

SILENCE_ADVICE = (
    "When it sends a command, it takes part again. kiks_kclose(ref) closes its port while it has nothing to do."
)

SILENCE_S = 0.1
"""Silence after which all replies have arrived [s of simulated time]."""

UNTOLD_NS = 120_000_000
"""Time for which it is not known whether a program thinks or stands in Octave's debugger [ns of real time]: Octave's
hook, which tells that, comes a tenth of a second after the prompt."""

_FRACTION = re.compile(r"(?<=,) *[+-]?(?:\d{1,15}\.\d*|\.\d+)(?:[eE][+-]?\d{1,2})? *(?=[,\r\n]|$)", re.ASCII)
"""A number of a command with a decimal point."""

_log = logging.getLogger("kiks.toolbox")

Result = TypeVar("Result")


@dataclass
class OpenPort:
    """An open port.

    Attributes:
        port: The port.
        robot: Number of the robot at its other end, from 1.
        opened_ns: Simulated time of its opening [ns].
        opened_wall_s: Real time of its opening [s].
        way_mm: Distances that the robot had driven by then, forwards and backwards [mm].
        start_mm: Place of the robot at that time [mm].
        last_ns: Simulated time of the last call of `pace` [ns].
        last_wall_s: Real time of that call [s].
        is_clean: Whether all expected replies have been read.
        is_talking: Whether further lines of a tool's reply may come.
    """

    port: VirtualPort
    robot: int
    opened_ns: int
    opened_wall_s: float
    way_mm: tuple[float, float]
    start_mm: tuple[float, float]
    last_ns: int
    last_wall_s: float
    is_clean: bool = True
    is_talking: bool = False

    def pace(self, now_ns: int) -> tuple[float, float]:
        """Return the speed of simulated time up to an instant [ns], since the opening and since the last call."""
        now_s = time.monotonic()
        average = s_from_ns(now_ns - self.opened_ns) / max(now_s - self.opened_wall_s, 1e-9)
        momentary = s_from_ns(now_ns - self.last_ns) / max(now_s - self.last_wall_s, 1e-9)
        self.last_ns, self.last_wall_s = now_ns, now_s
        return average, momentary


class SessionClient:
    """A program in another process that takes part in a session.

    While it has an open port, the world waits for it as for a program of `kiks run`. Its thinking time is the time
    between an answer and its next request.

    Args:
        session: The session.
        number: Its number, from 1 in the order of joining.
        awaited: The answer under way; if left out, the program waits for every answer.

    Attributes:
        ports: The open ports by number: 1 for port -1.
        openings: The last opening of each port in this world.
        asked: Number of the port that the present request concerns; 0 for none.
        film: The film that it makes of the world; None for none.
        turrets: The names of the turrets that are functions of the program, by their numbers.
        last_line: Number of the line of the desk's log that it has printed last; 0 for none.
        typed: Commands for the program to evaluate that people have typed on the desk, the oldest first.
        clock: What `tic`, `toc` and the like of the program tell.
        is_standing: Whether it has stopped in Octave's debugger, and a person is at the prompt.
    """

    def __init__(self, session: Session, number: int, awaited: AwaitedAnswer | None = None) -> None:
        self.session = session
        self.awaited = AwaitedAnswer() if awaited is None else awaited
        self.number = number
        self.name = f"program {number} (Octave or MATLAB)"
        self.asked = 0
        self.ports: dict[int, OpenPort] = {}
        self.openings: dict[int, OpenPort] = {}
        self.film: SessionFilm | None = None
        self.turrets: dict[int, str] = {}
        self.last_line = 0
        self.typed: deque[str] = deque()
        self.is_standing = False
        self._given = session.given
        self._program = ProgramClock("none") if self._given is None else self._given.program
        self.clock = SessionClock() if self._given is None else self._given.clock
        self._place: object = None
        self._link: Link | None = None
        self._pace = 1.0, 1.0
        session.clients.append(self)

    # ---- ports ----

    def open(self, number: int, baud: int) -> None:
        """Open a port.

        Raises:
            LinkError: If it is open already.
        """
        session = self.session
        if number in self.ports:
            raise LinkError(
                f"port {-number} must be closed before it is opened, but it is open. Use kiks_kclose([]) first."
            )
        if not session.has_begun:
            session.begin_arena(Arena.default())
        if session.place is not self._place:
            self._lose_world()
            self._place = session.place
        if self._link is None:
            self._link = self._connect()
        if not self.ports:
            self._link.wake()
            # A new clock, so that the time without an open port does not count as thinking.
            self._program = ProgramClock(session.thinking) if self._given is None else self._given.program
        try:
            self.ports[number] = self.openings[number] = self._open(number, baud, self._link)
        finally:
            self._rest_if_idle()
        self.asked = number

    def _connect(self) -> Link:
        if self._given is not None:
            return self._given.link
        desk = self.session.desk
        assert desk is not None
        return ThreadLink(desk.programs, self.name, self.number, self.awaited, SILENCE_ADVICE)

    def _open(self, number: int, baud: int, link: Link) -> OpenPort:
        given = self._given
        robot = self._robot_here(number) if given is None else given.robot_of(number)
        port = VirtualPort(RemoteLine(link, robot), self._program)
        port.claim(f"{self.name}, port {-number}")
        port.baudrate = baud
        port.timeout = ANSWER_S
        self._meet()
        way_mm = start_mm = 0.0, 0.0
        if given is None:
            sim = self.session.world
            with sim.lock:
                start_mm = sim.pose(robot)[:2]
                forwards_mm, backwards_mm, _ = sim.distances_mm()[robot - 1].tolist()
                way_mm = forwards_mm, backwards_mm
        now_ns, now_s = port.ask_ns(), time.monotonic()
        return OpenPort(port, robot, now_ns, now_s, way_mm, start_mm, now_ns, now_s)

    def _robot_here(self, number: int) -> int:
        """Return the robot of a port about to be opened in the session's world, with the program's turrets."""
        sim, known = self.session.world, self.openings.get(number)
        robot = self.take_robot(number) if known is None else known.robot
        for turret, name in self.turrets.items():
            if turret not in sim.wires[robot - 1].firmware.turrets:
                sim.fit(robot, OwnTurret(turret, name))
        self.session.trace(for_new_port=True)
        return robot

    def close(self, number: int) -> None:
        """Close a port, or all ports for number 0; ignore a closed one. The robot drives on."""
        if self.ports and self._place is not self.session.place:
            self._lose_world()
        for each in list(self.ports) if number == 0 else [number]:
            if each in self.ports:
                self._meet()
                assert self._link is not None
                opened = self.ports.pop(each)
                self._pace = opened.pace(self._link.now_ns)
                opened.port.close()
        self._rest_if_idle()

    def leave(self) -> None:
        """Leave the session: earlier requests are still done, and other clients may take the robots."""
        self._lose_world()
        self.session.release_robots(self)
        self.session.clients.remove(self)
        if self.film is not None:
            try:
                self.film.save(lambda share: None)
            except KiksError as error:
                _log.warning("%s", error)

    def cancel(self) -> None:
        """Cancel the request under way; from any thread."""
        link = self._link
        if link is not None:
            link.cancel()

    def opened(self, number: int) -> OpenPort:
        """Return an open port.

        Raises:
            LinkError: If it is not open, or its world was replaced.
        """
        opened = self.ports.get(number)
        if opened is None:
            raise LinkError(
                f"port {-number} must be open, but it is not. Open it: ref = kiks_kopen([{-number} 9600 1])."
            )
        if self._place is not self.session.place:
            self._lose_world()
            raise LinkError(
                "the port must belong to the present world, but another world has taken its place. Open the port "
                "again: ref = kiks_kopen([-1 9600 1])."
            )
        self.asked = number
        return opened

    # ---- what people ask for on the desk ----

    def halt(self) -> None:
        """Stop the program: the request under way, or else the next one, fails; from any thread."""
        self.awaited.is_halted = True
        self.cancel()

    def next_command(self) -> str:
        """Return the answer that makes the program evaluate the next typed command; there is one."""
        return f"!{escape(self.typed.popleft())}"

    def take_halt(self) -> bool:
        """Return whether the program was halted since the last call; then its ports are closed and its robots stop."""
        if not self.awaited.is_halted:
            return False
        self.awaited.is_halted = False
        if self._link is not None:
            self._link.halt()
            self._link = None
        self.ports.clear()
        return True

    # ---- the line ----

    def send(self, number: int, text: str) -> str:
        """Send characters and return the first reply without its line end.

        As in KiKS 2.2.0, each call is a command of its own, even without a terminator, and numbers may have fractions,
        which are rounded.

        Raises:
            TurretOrder: If the program must work out the reply; then nothing was sent.
        """
        opened = self.opened(number)
        if not text.endswith(("\n", "\r")):
            text += "\n"
        if self.turrets and addressed_turret(text) in self.turrets:
            raise TurretOrder(number, text[:-1])
        if "." in text:
            text = _FRACTION.sub(_rounded, text)
        return self._exchange(opened, text)

    def send_order(self, number: int, order: str, reply: str) -> str:
        """Send an order for a turret and let the robot reply what the program has worked out; return the reply."""
        opened = self.opened(number)
        firmware = self.session.world.wires[opened.robot - 1].firmware
        firmware.dictated = (order.encode("latin-1", errors="replace"), reply.encode("latin-1", errors="replace"))
        try:
            return self._exchange(opened, order + "\n")
        finally:
            firmware.dictated = None

    def _exchange(self, opened: OpenPort, text: str) -> str:
        port, data = opened.port, text.encode("latin-1", errors="replace")
        if opened.is_talking:
            # The caller wanted the first line of them only.
            self._read_until_silent(opened)
        if not opened.is_clean:
            port.reset_input_buffer()
            opened.is_clean = True
        latency_s = self.session.settings.latency_s
        if latency_s:
            port.sleep(latency_s)
        port.write(data)
        # The robot does not answer empty lines.
        commands = data.replace(b"\r", b"\n").split(b"\n")
        replies = [port.read_until(b"\n") for command in commands if command]
        opened.is_clean = all(reply.endswith(b"\n") for reply in replies)
        # Commands of one letter answer with one line, tools such as list with several.
        opened.is_talking = any(command[:1].islower() for command in commands)
        return replies[0].rstrip(b"\r\n").decode("ascii", errors="replace") if replies else ""

    def listen(self, number: int) -> str:
        """Return all characters that arrive until the line is silent."""
        return self._read_until_silent(self.opened(number)).decode("ascii", errors="replace")

    def _read_until_silent(self, opened: OpenPort) -> bytes:
        lines = b""
        opened.port.timeout = SILENCE_S
        try:
            while line := opened.port.read_until(b"\n"):
                lines += line
        finally:
            opened.port.timeout = ANSWER_S
        opened.is_talking = False
        return lines

    # ---- the film ----

    def begin_film(self, number: int, path: Path) -> None:
        """Make a film of the world from now on.

        Args:
            number: Of the port whose robot's readings are shown.
            path: The film's file.
        """
        robot = self.opened(number).robot
        if self.film is not None:
            raise ParameterError("a program must make one film at a time, but it makes one. Call kiks_kclose first.")
        self.film = self.do(lambda sim: SessionFilm(sim, path, robot))

    def save_film(self) -> int:
        """End the film at the program's time and make it; return the number of its pictures, 0 without a film."""
        film, self.film = self.film, None
        if film is None:
            return 0
        with suppress(LinkError):  # the world may have been replaced
            self.do(lambda sim: None)

        def check_awaited(share: float) -> None:
            if self.awaited.is_cancelled:
                raise LinkError("The program was interrupted; the film was discarded.")

        return film.save(check_awaited)

    # ---- time ----

    def stamp(self) -> str:
        """Return the port of the request and the time since its opening [s], in 19 characters; 0 for no port.

        The number is negative if thinking is measured: then time passes on between requests.
        """
        self._set_clock()
        opened = self.ports.get(self.asked)
        if opened is None or self._link is None:
            return "  0     0.000000000"
        number = -self.asked if self._program.measures else self.asked
        return f"{number:3d}{s_from_ns(self._link.now_ns - opened.opened_ns):16.9f}"

    def time_s(self, number: int) -> float | None:
        """Return the simulated time since a port was opened [s]; None if it is closed."""
        if number not in self.ports:
            return None
        opened = self.opened(number)
        return s_from_ns(opened.port.ask_ns() - opened.opened_ns)

    def ask_clock(self) -> SessionClock:
        """Return the program's clock; looking at it may take simulated time, as a poll does."""
        if (port := self._timer()) is not None:
            port.ask_ns()
        self._set_clock()
        return self.clock

    def waits_itself(self) -> bool:
        """Return whether a real pause of the program lets the right time pass: it is measured, and not scaled."""
        desk = self.session.desk
        is_paced = desk is not None and desk.present.gate.speed is not None
        return self._timer() is None or (self._program.is_real_time and not is_paced)

    def pause(self, seconds: float) -> None:
        """Let simulated time pass [s].

        Raises:
            LinkError: If no port is open.
        """
        port = self._timer()
        if port is None:
            raise LinkError("a port must be open for simulated time to pass, but none is. Call kiks_kopen first.")
        port.sleep(seconds)
        if self._link is not None:
            self._meet()

    def live(self, time_ns: int) -> bool:
        """Let time pass [ns] while the program thinks; return whether it did."""
        link = self._link
        is_thinking = not self.is_standing and self._program.thought_ns() > UNTOLD_NS
        return link is not None and is_thinking and link.live(time_ns)

    def stand(self) -> None:
        """Note that the program stands in Octave's debugger; called a few times a second while it does."""
        self.is_standing = True
        link = self._link if self._given is None else self._given.link
        if link is not None:
            link.send(Verb.REACHED)  # it is not silent: other programs wait for it

    def go_on(self, thought_s: float) -> None:
        """Note that it goes on, or that a person calls a function at the prompt, with the time that it has thought [s].

        That is the time since the last answer without the time at the prompt.
        """
        self.is_standing = False
        self._program.set_thought(round(thought_s * NS_PER_S))

    def pace(self) -> tuple[float, float]:
        """Return the speed of simulated time since a port was opened and since the last call; 1 is real time.

        After the ports were closed these are the last figures.
        """
        if self.ports:
            opened = self.opened(next(iter(self.ports)))
            self._pace = opened.pace(opened.port.ask_ns())
        return self._pace

    # ---- the world ----

    def do(self, act: Callable[[Simulation], Result]) -> Result:
        """Call a function with the locked world at the program's own time.

        Raises:
            LinkError: If there is no world.
        """
        sim = self.session.world
        if self.ports:
            # Polling takes simulated time, so that a program that polls the world does not wait for ever.
            self.opened(next(iter(self.ports))).port.ask_ns()
            self._meet()
        with sim.lock:
            return act(sim)

    def robot(self, number: int) -> int | None:
        """Return the number of the robot of an open or closed port; None if it has none yet."""
        if self._place is self.session.world and number in self.openings:
            return self.openings[number].robot
        robot = self._usual_robot(number)
        is_there = 1 <= robot <= self.session.world.robot_count
        return robot if is_there and self.session.owners.get(robot, self) is self else None

    def take_robot(self, number: int) -> int:
        """Take a robot for a port that has none yet, a new one if all are taken; return its number."""
        return self.session.take_robot(self, self._usual_robot(number))

    # ---- inside ----

    def _usual_robot(self, number: int) -> int:
        """Return the preferred robot of a port: the ports of program 1 begin with robot 1, and so on."""
        return self.number + number - 1

    def _timer(self) -> VirtualPort | None:
        """Return a port that tells the program's time; None while that is the computer's."""
        if self.ports:
            return self.opened(next(iter(self.ports))).port
        return None if self._given is None else self._given.timer

    def _set_clock(self) -> None:
        """Let the program's clock follow the world while a port is open; called after each request."""
        if self._given is None:
            self.clock.follow(self._link if self.ports else None)

    def _meet(self) -> None:
        """Advance the world to the program's time."""
        assert self._link is not None
        self._link.meet()

    def _rest_if_idle(self) -> None:
        """Let the world run without this program while it has no open port."""
        if not self.ports and self._link is not None:
            self._link.rest()

    def _lose_world(self) -> None:
        self.ports.clear()
        self.openings.clear()
        if self._link is not None:
            self._link.close()
            self._link = None


def _rounded(number: re.Match[str]) -> str:
    """Return a number as a whole one, rounded like `round` of Octave and MATLAB."""
    value = float(number[0])
    return str(int(math.copysign(math.floor(abs(value) + 0.5), value)))
