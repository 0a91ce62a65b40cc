"""`kiks.here`: the robot as it is, for a person who has stopped its program in a debugger."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NamedTuple

from kiks.errors import KiksError
from kiks.model.checks import check_count
from kiks.script.callers import is_for_program
from kiks.units import s_from_ns


class Here(NamedTuple):
    """A robot at an instant; see `kiks.here`.

    Attributes:
        robot: Its number.
        time_s: Simulated time [s].
        x_mm: From the arena's lower left corner to the right [mm].
        y_mm: Upwards from there [mm].
        heading_deg: 0 looks right, 90 up.
        proximity: What command `N` would return, without noise.
        light: What `O` would.
        encoders: What `H` would.
        speeds: What `E` would.
        to_robot: Commands on their way to it.
        from_robot: Answers that the program has not read yet.
    """

    robot: int
    time_s: float
    x_mm: float
    y_mm: float
    heading_deg: float
    proximity: tuple[int, ...]
    light: tuple[int, ...]
    encoders: tuple[int, ...]
    speeds: tuple[int, ...]
    to_robot: bytes
    from_robot: bytes

    def __repr__(self) -> str:
        return (
            f"robot {self.robot} at {self.time_s:.3f} s: {self.x_mm:.1f}, {self.y_mm:.1f} mm, {self.heading_deg:.1f} "
            f"deg; proximity {self.proximity}, light {self.light}, encoders {self.encoders}, speeds {self.speeds}; "
            f"to the robot {self.to_robot!r}, not read {self.from_robot!r}"
        )


class _Asking:
    """The robot of this program, as it is now; `kiks.here[2]` is another one of its world.

    It has what `kiks.script.here.Here` has. Asking takes no time, and changes nothing of the run.

    Attributes:
        ask: Returns what `kiks.sim.robot_state.state_of` returns of a robot; None without a program.
        own: Returns the number of the program's own robot.

    Example:
        >>> import kiks
        >>> try:
        ...     kiks.here.x_mm
        ... except kiks.KiksError as error:
        ...     print(error)
        kiks.here must be asked in a program under kiks run, but there is none. Start it so.
    """

    def __init__(self) -> None:
        self.ask: Callable[[int], tuple[Any, ...]] | None = None
        self.own: Callable[[], int] = lambda: 1

    def __getitem__(self, robot: int) -> Here:
        if self.ask is None:
            raise KiksError("kiks.here must be asked in a program under kiks run, but there is none. Start it so.")
        now_ns, *rest = self.ask(check_count("robot", robot, 1))
        return Here(robot, s_from_ns(now_ns), *rest)

    def __getattr__(self, name: str) -> Any:
        if name not in Here._fields:
            raise AttributeError(name)
        return getattr(self.look(), name)

    def __dir__(self) -> list[str]:
        return [*Here._fields]

    def __repr__(self) -> str:
        # A notebook or a reference shows it outside of a program, too.
        return "kiks.here, of no program" if self.ask is None else repr(self.look())

    def look(self) -> Here:
        """Return what is to be known of the program's own robot."""
        return self[self.own()]


here = _Asking()
"""The robot of this program, as it is now."""


@contextmanager
def showing_robot(frame: FrameType | None) -> Iterator[None]:
    """Let a debugger find `kiks` meanwhile, and show `kiks.here` beside the globals of the program."""
    shown = {"kiks": sys.modules["kiks"], "kiks.here": here}
    added: dict[int, tuple[dict[str, Any], set[str]]] = {}
    while frame is not None:
        names = frame.f_globals
        if id(names) not in added and is_for_program(frame):
            added[id(names)] = names, shown.keys() - names.keys()
            names.update({name: shown[name] for name in added[id(names)][1]})
        frame = frame.f_back
    try:
        yield
    finally:
        for names, new in added.values():
            for name in new:
                names.pop(name, None)
