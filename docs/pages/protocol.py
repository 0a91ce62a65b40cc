"""Write `docs/reference/protocol.md` from the firmware's own table of commands: `python docs/pages/protocol.py`.

The examples are executed as the page is made, so that they are true. A test fails when the page is out of date.
"""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Iterator
from pathlib import Path

from kiks.firmware.khepera import tools
from kiks.firmware.khepera.commands import COMMANDS, NO_TURRET, PROTOCOL_ERROR
from kiks.firmware.khepera.firmware import UNKNOWN
from kiks.firmware.receiver import LINE_LIMIT
from kiks.firmware.robot_kind import RobotCommand
from kiks.model.arena import Arena
from kiks.model.robot import RobotSpec
from kiks.sim.simulation import Simulation

PAGE = Path(__file__).parents[1] / "reference" / "protocol.md"

EXAMPLES: dict[str, tuple[str | float, ...]] = {
    "A": ("A,3800,800,100",),
    "B": ("B",),
    "C": ("G,0,0", "C,1000,1000", 2.0, "H", "K"),
    "D": ("D,5,-5",),
    "E": ("D,10,10", 0.5, "E"),
    "F": ("F,3000,20,4000",),
    "G": ("G,100,-100", "H"),
    "H": ("D,10,10", 1.0, "H"),
    "I": ("I,3",),
    "J": ("J,40,128,40,128",),
    "K": ("D,20,20", 0.5, "K"),
    "L": ("L,0,1", "L,0,2"),
    "N": ("N",),
    "O": ("O",),
    "P": ("P,50,50", 0.5, "E"),
    "R": ("R,32",),
    "T": ("T,1,B", "T,1,D,0", "T,2,B"),
    "W": ("W,170,32",),
    "help": ("help D",),
    "list": ("list",),
    "net": ("net",),
    "process": ("process",),
    "memory": ("memory",),
    "k-team": ("k-team",),
    "serial": ("serial 19200",),
    "restart": ("G,100,-100", "restart", "H"),
    "run": ("run demo",),
    "sfill": ("sfill",),
    "flash": ("flash E",),
}
"""What is sent for each command and tool; a number lets simulated time pass [s]."""

ERRORS = (
    (UNKNOWN, "the first word is no command and no tool; a line of blanks, too", ("M", "d,5,5", "D5,5", " ")),
    (PROTOCOL_ERROR, "a number is missing, too many, not whole or not allowed", ("D,5", "D,5,5,5", "D,5.0,5", "L,2,0")),
    (NO_TURRET, "a message to a turret that is not fitted", ("T,3,B",)),
)


def robot() -> Simulation:
    """Return a robot without noise, with a gripper, 30 mm in front of a wall at its left."""
    quiet = RobotSpec.load("khepera_ii").with_changes(
        proximity__jitter_counts=(0.0,),
        proximity__noise_small=0.0,
        proximity__noise_large=0.0,
        ambient__noise_counts=0.0,
    )
    sim = Simulation(Arena.box(1000, 1000), robot=quiet)
    sim.place(1, 300.0, 935.0, math.radians(10))
    sim.fit(1, "gripper")
    return sim


def example(steps: tuple[str | float, ...]) -> Iterator[str]:
    """Yield the lines of a dialogue with a fresh robot, just as it takes place."""
    port = robot().port(1)
    port.timeout = 0.5
    yield "```"
    for step in steps:
        if isinstance(step, float):
            port.sleep(step)
            yield f"   ({step:g} s later)"
            continue
        port.write(step.encode() + b"\n")
        yield f"-> {step}"
        yield f"<- {port.readline().decode().rstrip()}"
        # Only tools answer more than a line; to wait for more than that would let the robot drive on.
        while step.islower() and (reply := port.readline()):
            yield f"<- {reply.decode().rstrip()}"
    yield "```"
    yield ""


def command(row: RobotCommand) -> Iterator[str]:
    """Yield the section of a command."""
    description = " ".join((row.act.__doc__ or "").split())
    yield f"### {row.letter}: {row.name}"
    yield ""
    yield description
    yield ""
    yield f"* Request: `{row.syntax}`"
    yield f"* Reply: `{','.join((row.letter.lower(), *row.reply))}`"
    if row.limits:
        yield f"* Units and limits: {row.limits}"
    yield ""
    yield from example(EXAMPLES.get(row.letter, (",".join((row.letter, *("1" for _ in row.parameters))),)))


def lines() -> Iterator[str]:
    """Yield the lines of the page."""
    yield "# The robot's protocol"
    yield ""
    yield "<!-- Written by docs/pages/protocol.py from the firmware's table. Do not edit. -->"
    yield ""
    yield (
        "A command is a line: a capital letter, then whole numbers with a comma before each, then CR, LF or both. The "
        "robot answers one line that begins with the same letter in lower case and ends in CR LF. A number may have a "
        "sign, leading zeros and blanks around it. Where a command has a left and a right number, left comes first. "
        f"Commands may be sent before earlier ones are answered. A line may have {LINE_LIMIT} characters; an empty one "
        "is not answered."
    )
    yield ""
    yield (
        "In the examples `->` goes to the robot and `<-` comes from it. They were made with a Khepera II without noise "
        "that has a gripper on its back and a wall 30 mm to its left."
    )
    yield ""
    yield "## At a glance"
    yield ""
    yield "| Request | Reply | What it does |"
    yield "|---|---|---|"
    for row in COMMANDS:
        reply = ",".join((row.letter.lower(), *row.reply))
        yield f"| `{row.syntax}` | `{reply}` | {row.name} |"
    yield ""
    yield "## One by one"
    yield ""
    for row in COMMANDS:
        yield from command(row)
    yield "## Tools"
    yield ""
    yield (
        "Words in lower case, for a person at a terminal. They answer as many lines as they like and say nowhere that "
        "they are done: a program that uses one has to read until nothing more comes."
    )
    yield ""
    for name, (summary, _) in tools.TOOLS.items():
        usage, _, meaning = summary.partition(": ")
        yield f"### {name}"
        yield ""
        only = " Khepera II only." if name == "flash" else ""
        yield f"`{usage}`: {meaning}.{only}"
        yield ""
        yield from example(EXAMPLES[name])
    yield "## Errors"
    yield ""
    yield "After an error everything in the robot is as it was before."
    yield ""
    for answer, meaning, requests in ERRORS:
        yield f"### {answer.decode().rstrip()}"
        yield ""
        yield f"{meaning[0].upper()}{meaning[1:]}."
        yield ""
        yield from example(requests)


def page() -> str:
    """Return the whole page."""
    return "\n".join(lines()).rstrip() + "\n"


if __name__ == "__main__":
    # The page shows refused commands, too; a hint for each is for people.
    logging.getLogger("kiks").setLevel(logging.ERROR)
    if "--check" in sys.argv:
        if PAGE.read_text(encoding="utf-8") != page():
            sys.exit(f"{PAGE.name} must be what the command table says, but is not. Run make docs.")
    else:
        PAGE.write_text(page(), encoding="utf-8")
        print(f"{PAGE.name} written")
