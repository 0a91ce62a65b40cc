"""`kiks monitor`."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.outputs import output
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import counted
from kiks.model.atomic_files import explained
from kiks.table import Table

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table as Grid

    from kiks.client.khepera import Khepera, Status

FULL_COUNTS = 1023
BAR_WIDTH = 10
"""Characters of a full proximity bar."""

RATE_MIN_HZ, RATE_MAX_HZ = 0.01, 100.0

RATE_WINDOW = 20
"""Number of samples over which the shown rate is averaged."""

_MODES = {0: "speed", 1: "position", 2: "PWM"}


class Sample(NamedTuple):
    """All readings of a robot at one time.

    Attributes:
        time_s: Time since the start at which the first command was sent [s].
        proximity: Reflected light, clockwise from the left [counts]; more is nearer.
        ambient: Ambient light [counts]; less is brighter.
        encoders: Position counters, left and right [pulses].
        speed: Measured speeds, left and right [pulses/10 ms].
        status: Reports of the two controllers.
    """

    time_s: float
    proximity: list[int]
    ambient: list[int]
    encoders: tuple[int, int]
    speed: tuple[int, int]
    status: tuple[Status, Status]

    def row(self) -> str:
        """Return the sample as a line of the log, in the order of `COLUMNS`."""
        states = [value for motor in self.status for value in (int(motor.on_target), motor.mode, motor.error)]
        numbers = [*self.proximity, *self.ambient, *self.encoders, *self.speed, *states]
        return ",".join((f"{self.time_s:.3f}", *map(str, numbers)))


COLUMNS = (
    "time_s",
    *(f"proximity_{sensor}_counts" for sensor in range(8)),
    *(f"ambient_{sensor}_counts" for sensor in range(8)),
    "left_pulses",
    "right_pulses",
    "left_speed_pulses",
    "right_speed_pulses",
    *(f"{side}_{what}" for side in ("left", "right") for what in ("on_target", "mode", "error_pulses")),
)
"""Columns of the log. Speeds and controllers' errors are in pulses/10 ms; errors of position moves are in pulses."""


def monitor(
    port: Annotated[str, typer.Option(help="Port of the robot: /dev/ttyUSB0, COM3, socket://host:port, kiks://1.")],
    baud: Annotated[int, typer.Option(help="Line speed [bit/s].", min=75, max=4_000_000)] = 9600,
    rate: Annotated[float, typer.Option(help="Samples per second; the line may allow fewer.")] = 10.0,
    csv: Annotated[
        Path | None, typer.Option(help="Log all readings to this new file.", callback=output(".csv", is_new=True))
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="End after this time [s]; otherwise Ctrl-C ends.")] = None,
) -> None:
    """Show and log all readings of a real or simulated robot.

    Example: kiks monitor --port /dev/ttyUSB0 --baud 38400 --csv today.csv
    """
    from rich.console import Console

    from kiks.client.khepera import Khepera
    from kiks.model.checks import SECONDS_MAX, check_number

    check_number("rate", rate, RATE_MIN_HZ, RATE_MAX_HZ, "At 9600 baud about 6 are possible.")
    if seconds is not None:
        check_number("seconds", seconds, 1e-3, SECONDS_MAX, "Leave it out for no end.")
    if port.startswith("kiks:"):
        ready_engine()
    end_as_with_ctrl_c()
    count, rate_hz = 0, 0.0
    times_s: deque[float] = deque(maxlen=RATE_WINDOW + 1)
    with ExitStack() as ends:
        robot = ends.enter_context(Khepera(port, baud=baud))
        bios, protocol = robot.version()
        wait = _pacer(robot)
        show = ends.enter_context(_display(Console(), f"{port}   BIOS {bios}, protocol {protocol}"))
        if csv is not None:
            _log(csv, ",".join(COLUMNS), "x")
        ends.enter_context(suppress(KeyboardInterrupt))
        for count, sample in enumerate(samples(robot, rate, seconds), 1):
            if csv is not None:
                _log(csv, sample.row())
            times_s.append(sample.time_s)
            rate_hz = (len(times_s) - 1) / (times_s[-1] - times_s[0]) if count > 1 else 0.0
            show(sample, rate_hz)
            wait()
    typer.echo(
        f"{counted(count, 'sample')}, {rate_hz:.1f} per second at the end{'' if csv is None else f', in {csv}'}",
        err=True,
    )


def samples(robot: Khepera, rate_hz: float, seconds: float | None) -> Iterator[Sample]:
    """Yield samples at a steady rate, or as fast as the line allows if that is slower.

    The commands of one sample take 0.15 s at 9600 baud, so the rate there is at most 6 or 7 Hz.

    Args:
        robot: The robot.
        rate_hz: Samples per second [Hz].
        seconds: Duration by the robot's clock [s]; None for no end.

    Raises:
        LinkError: If the robot does not answer.
    """
    start_s, due_s = robot.time_s, 0.0
    while due_s < (math.inf if seconds is None else seconds):
        now_s = robot.time_s - start_s
        if now_s < due_s:
            robot.pause(due_s - now_s)
            now_s = robot.time_s - start_s
        yield Sample(now_s, robot.proximity(), robot.ambient(), robot.encoders(), robot.speed(), robot.status())
        # After a late sample the next one is due at once; missed samples are not made up for.
        due_s = max(due_s + 1.0 / rate_hz, robot.time_s - start_s)


def _pacer(robot: Khepera) -> Callable[[], None]:
    """Return a function that keeps a simulated robot at real time; for a real robot it does nothing."""
    from kiks.clock.pace import Pace
    from kiks.sim.simulation import SimPort

    port = robot.port
    if not isinstance(port, SimPort):
        return lambda: None
    sim, pace = port.sim, Pace(1.0)
    pace.start(sim.now_ns)
    return lambda: time.sleep(pace.wall_wait_s(sim.now_ns))


def _log(path: Path, line: str, mode: str = "a") -> None:
    """Write a line into the log, so that it is there whatever ends the command."""
    with explained(path, "the log"), open(path, mode, encoding="utf-8") as file:
        print(line, file=file)


@contextmanager
def _display(console: Console, title: str) -> Iterator[Callable[[Sample, float], None]]:
    """Yield a function that shows a sample: as a picture on a terminal, otherwise as a line of the log."""
    if not console.is_terminal:
        typer.echo(title, err=True)
        typer.echo(",".join(COLUMNS))
        yield lambda sample, rate_hz: typer.echo(sample.row())
        return
    from rich.live import Live

    with Live(console=console, auto_refresh=False, screen=False) as live:
        yield lambda sample, rate_hz: live.update(picture(sample, rate_hz, title, console.width), refresh=True)


def picture(sample: Sample, rate_hz: float, title: str, width: int = 80) -> Grid:
    """Return a sample as the robot seen from above, its front at the top, with a table of the rest below.

    Args:
        sample: The readings.
        rate_hz: Recent samples per second.
        title: The title.
        width: Characters of a line, at least 60.
    """
    from rich.bar import Bar
    from rich.table import Table as Grid
    from rich.text import Text

    # A row has four sensors, each with its number, bar and reading, and a blank after each of them.
    bar_width = min(BAR_WIDTH, width // 4 - len("0 ") - len(" 1023 "))

    def cells(sensor: int | None) -> list[Text | Bar]:
        if sensor is None:
            return [Text()] * 3
        count = sample.proximity[sensor]
        colour = "green" if count < FULL_COUNTS / 3 else "yellow" if count < FULL_COUNTS * 2 / 3 else "red"
        bar = Bar(FULL_COUNTS, 0, count, width=bar_width, color=colour)
        return [Text(str(sensor), "dim"), bar, Text(f"{count:4d}", colour)]

    around = Grid.grid(padding=(0, 1))
    for row in ((None, 2, 3, None), (1, None, None, 4), (0, None, None, 5), (None, 7, 6, None)):
        around.add_row(*chain.from_iterable(map(cells, row)))
    rows = [
        (side, counter, speed, _MODES.get(motor.mode, motor.mode), "yes" if motor.on_target else "no", motor.error)
        for side, counter, speed, motor in zip(
            ("left", "right"), sample.encoders, sample.speed, sample.status, strict=True
        )
    ]
    wheels = Table(("wheel", "pulses", "pulses/10 ms", "mode", "on target", "error"), rows).for_output()
    whole = Grid.grid()
    whole.add_row(Text(title, "bold"))
    whole.add_row(f"{sample.time_s:.2f} s   {rate_hz:.1f} samples per second   Ctrl-C ends")
    ambient = f"ambient, 0 to 7  {''.join(f'{count:5d}' for count in sample.ambient)}"
    for part in ("", around, "", ambient, "", wheels):
        whole.add_row(part)
    return whole
