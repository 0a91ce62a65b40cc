"""`kiks calibrate`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from kiks.cli.engine_start import ready_engine
from kiks.cli.outputs import output
from kiks.ending import end_as_with_ctrl_c
from kiks.errors import ParameterError
from kiks.model.robot_kinds import ROBOT_NAMES

if TYPE_CHECKING:
    from kiks.client.serial_robot import SerialRobot
    from kiks.fit.placements import Placements

REPEAT_MAX_MM = 2000.0


def calibrate(
    port: Annotated[str, typer.Option(help="Port of the robot: /dev/ttyUSB0, COM3, socket://host:port, kiks://1.")],
    out: Annotated[Path, typer.Option(help="Robot file to write, .toml, for --robot.", callback=output(".toml"))],
    base: Annotated[
        str, typer.Option(help=f"Its kind, for all that is not measured: {', '.join(ROBOT_NAMES)}, a file.")
    ] = ("khepera"),
    baud: Annotated[
        int | None, typer.Option(help="Line speed [bit/s]; the kind's own if left out.", min=75, max=4_000_000)
    ] = None,
    gaps: Annotated[
        str | None, typer.Option(help="Marks [mm] from the wall at which the robot spins: 5,15,25.")
    ] = None,
    run_up: Annotated[float, typer.Option(help="Mark [mm] from which it drives towards the wall.")] = 500.0,
    yes: Annotated[bool, typer.Option("--yes", help="Take every default: for simulated robots.")] = False,
) -> None:
    """Measure a robot, and write a file for a simulated one like it.

    It stands in front of a white wall. The command says where to put the robot, and waits. It moves a simulated robot
    (kiks://1) by itself.

    Example: kiks calibrate --port /dev/ttyUSB0 --out mine.toml
    """
    ready_engine()
    from kiks.client.port import open_port
    from kiks.client.serial_robot import SerialRobot
    from kiks.fit.calibrate import calibrate as measure
    from kiks.model.robot import RobotSpec, save_robot

    kind = RobotSpec.load(base)
    marks = None if gaps is None else parse_gaps(gaps)
    end_as_with_ctrl_c()
    baud = baud or kind.firmware.baud
    # The start bit and eight of data; the rest are stop bits.
    with SerialRobot(open_port(port, baud, stop_bits=kind.firmware.bits_per_character - 9)) as robot:
        placements = TerminalPlacements(simulated_placements(robot), asks=not yes)
        found = measure(robot, placements, kind, baud=baud, gaps_mm=marks, run_up_mm=run_up, say=typer.echo)
    comment = [
        f"Measured by 'kiks calibrate' on {port}; other constants are those of {kind.name!r}.",
        *found.lines(),
    ]
    save_robot(found.spec, out, comment="\n".join(comment))
    typer.echo("\n".join(found.lines()))
    typer.echo(f"Written: {out}. Use it with --robot {out}, or kiks.Simulation(robot={str(out)!r}).")


class TerminalPlacements:
    """Asks the person at the terminal to put the robot in place; a hand moves a simulated one."""

    def __init__(self, hand: Placements | None = None, *, asks: bool = True) -> None:
        self.hand = hand
        self.asks = asks
        self.count = 0

    def place(self, instruction: str, gap_mm: float | None = None) -> float | None:
        """Print an instruction and wait; return the gap that the person enters, by default the marked one [mm]."""
        self.count += 1
        typer.echo(f"\n{self.count}. {instruction}")
        if self.asks and gap_mm is not None:
            gap_mm = _ask_gap("   Gap between wall and rim in mm; Enter when it stands there", gap_mm)
        elif self.asks:
            typer.prompt("   Enter when it stands there", default="", show_default=False)
        if self.hand is not None:
            self.hand.place(instruction, gap_mm)
        typer.echo("   Measuring; hands off ...")
        return gap_mm

    def wants_repeat(self, finding: str, *, is_good: bool) -> bool:
        """Show a result and ask whether to measure again; the default is no for a good result."""
        typer.echo(f"   {finding}")
        if not self.asks:
            return False
        return typer.confirm("   Do that again?", default=not is_good)


def _ask_gap(question: str, default_mm: float) -> float:
    while True:
        gap_mm = float(typer.prompt(question, default=default_mm, type=float))
        if 0 < gap_mm <= REPEAT_MAX_MM:
            return gap_mm
        typer.echo(f"   The gap must be above 0 and up to {REPEAT_MAX_MM:g} mm, but it was {gap_mm:g}. Measure again.")


def simulated_placements(robot: SerialRobot) -> Placements | None:
    """Return the object that can move the robot: None unless it is simulated in this process."""
    from kiks.fit.placements import SimPlacements
    from kiks.sim.simulation import SimPort

    port = robot.port
    return SimPlacements(port.sim, port.robot) if isinstance(port, SimPort) else None


def parse_gaps(text: str) -> list[float]:
    """Return the numbers of '5,15,25' [mm].

    Example:
        >>> parse_gaps("5,15,25.5")
        [5.0, 15.0, 25.5]
    """
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        raise ParameterError(f"--gaps must be numbers with commas, but it was {text!r}. Example: 5,15,25,35.") from None
