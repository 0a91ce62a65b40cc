"""`kiks monitor`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.outputs import output
from kiks.ending import end_as_with_ctrl_c

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from kiks.client.monitor import Sample

FULL_COUNTS = 1023
BAR_WIDTH = 10
"""Characters of a full proximity bar."""

_PARTS = " ▏▎▍▌▋▊▉█"
_MODES = {0: "speed", 1: "position", 2: "PWM"}


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
    from kiks.client.monitor import CsvLog, RateMeter, logged, samples

    if port.startswith("kiks:"):
        ready_engine()
    console = Console()
    end_as_with_ctrl_c()
    count, rate_hz, log = 0, 0.0, None
    with Khepera(port, baud=baud) as robot:
        stream = samples(robot, rate_hz=rate, seconds=seconds)
        bios, protocol = robot.version()
        title = f"{port}   BIOS {bios}, protocol {protocol}"
        wait = _pacer(robot)
        meter = RateMeter()
        try:
            log = None if csv is None else CsvLog(csv)
            with _display(console, title) as show:
                for sample in logged(stream, log):
                    count += 1
                    rate_hz = meter.note(sample.time_s)
                    show(sample, rate_hz)
                    wait()
        except KeyboardInterrupt:
            pass
        finally:
            if log is not None:
                log.close()
    typer.echo(f"{count} samples, {rate_hz:.1f} per second at the end{'' if csv is None else f', in {csv}'}")


def _pacer(robot: object) -> Callable[[], None]:
    """Return a function that keeps a simulated robot at real time; for a real robot it does nothing."""
    import time

    from kiks.client.khepera import Khepera
    from kiks.clock.pace import Pace
    from kiks.sim.simulation import SimPort

    port = robot.port if isinstance(robot, Khepera) else None
    if not isinstance(port, SimPort):
        return lambda: None
    sim, pace = port.sim, Pace(1.0)
    pace.start(sim.now_ns)
    return lambda: time.sleep(pace.wall_wait_s(sim.now_ns))


@contextmanager
def _display(console: Console, title: str) -> Iterator[Callable[[Sample, float], None]]:
    """Yield a function that shows a sample: as a picture on a terminal, otherwise as a line."""
    if not console.is_terminal:
        typer.echo(title)
        yield lambda sample, rate_hz: typer.echo(line(sample, rate_hz))
        return
    from rich.live import Live

    with Live(console=console, auto_refresh=False, screen=False) as live:
        yield lambda sample, rate_hz: live.update(picture(sample, rate_hz, title, console.width), refresh=True)


def line(sample: Sample, rate_hz: float) -> str:
    """Return a sample as a line of text."""
    words = [f"{sample.time_s:9.3f} s"]
    for letter, values in zip("NOHE", sample[1:5], strict=True):
        words.append(f"{letter} {' '.join(map(str, values))}")
    words.append(f"K {' '.join(f'{int(motor.on_target)} {motor.mode} {motor.error}' for motor in sample.status)}")
    return "   ".join((*words, f"{rate_hz:.1f} Hz"))


def bar(count: float, width: int = BAR_WIDTH) -> str:
    """Return a reading as a bar and a number, always of the same width.

    Example:
        >>> bar(512)
        '█████       512'
    """
    eighths = round(min(max(count / FULL_COUNTS, 0.0), 1.0) * width * 8)
    full, rest = divmod(eighths, 8)
    return f"{('█' * full + _PARTS[rest].strip()).ljust(width)} {count:4.0f}"


def picture(sample: Sample, rate_hz: float, title: str, width: int = 80) -> Table:
    """Return a sample as the robot seen from above, its front at the top, with a table of the rest below.

    Args:
        sample: The readings.
        rate_hz: Recent samples per second.
        title: The title.
        width: Characters of a line, at least 60.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    def cell(sensor: int | None) -> Text:
        if sensor is None:
            return Text("")
        count = sample.proximity[sensor]
        colour = "green" if count < FULL_COUNTS / 3 else "yellow" if count < FULL_COUNTS * 2 / 3 else "red"
        return Text(f"{sensor} ", "dim").append(bar(count, bar_width), colour)

    # A row has four sensors, each with its number, bar and reading, and two blanks between them.
    bar_width = min(BAR_WIDTH, (width - 3 * 2) // 4 - len("0 ") - len(" 1023"))
    around = Table.grid(padding=(0, 2))
    for row in ((None, 2, 3, None), (1, None, None, 4), (0, None, None, 5), (None, 7, 6, None)):
        around.add_row(*(cell(sensor) for sensor in row))
    light = Table(box=box.SIMPLE, padding=(0, 1))
    light.add_column("sensor")
    for sensor in range(len(sample.ambient)):
        light.add_column(str(sensor), justify="right", min_width=3)
    light.add_row("ambient", *map(str, sample.ambient))
    wheels = Table(box=box.SIMPLE, padding=(0, 1))
    for name in ("wheel", "counter [pulses]", "speed [pulses/10 ms]", "mode", "on target", "error"):
        wheels.add_column(name, justify="left" if name == "wheel" else "right")
    for side, counter, speed, motor in zip(
        ("left", "right"), sample.encoders, sample.speed, sample.status, strict=True
    ):
        on_target = "yes" if motor.on_target else "no"
        mode = _MODES.get(motor.mode, str(motor.mode))
        wheels.add_row(side, str(counter), str(speed), mode, on_target, str(motor.error))
    whole = Table.grid()
    whole.add_row(Text(title, "bold"))
    whole.add_row(f"{sample.time_s:.2f} s   {rate_hz:.1f} samples per second   Ctrl-C ends")
    for part in ("", around, light, wheels):
        whole.add_row(part)
    return whole
