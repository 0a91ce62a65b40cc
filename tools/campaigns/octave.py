"""Ctrl-C in Octave at random moments: the prompt comes back, the next command is right, and no process is left."""

from __future__ import annotations

import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import NoReturn

from tests.matlab.octave import OCTAVE
from tests.matlab.terminal import Terminal, state
from tools.campaigns.processes import compile_engine
from tools.campaigns.runner import Broken, Campaign, Figure, Play

from kiks.toolbox.framing import HANDSHAKE_S

PRESSES = 10
"""How often Ctrl-C is pressed in a session."""

STARTS = 5
"""How often the start of a session is interrupted in a case."""

LATEST_S, LATEST_START_S = 1.2, 4.0
"""Longest times after which Ctrl-C is pressed, in a program and in the start of a session [s]."""

PROMPT = "<prompt>"

OPEN = "ref = kiks_kopen([-1 9600 1]);"

LINES = (
    "kiks_pause(1e5)",
    "pause(1e3)",
    "while true, kProximity(ref); end",
    "while true, kSetSpeed(ref, 3, 2); kiks_ktime(-1); end",
    "while true, kiks_siminfo_robotpath; kLinVis(ref); end",
    "while true, kiks_siminfo_objects; kiks_pause(0.01); end",
    f"while true, kiks_kclose(ref); {OPEN} end",
    "while true, kiks_arena(zeros(300, 300)); " + OPEN + " end",
)
"""What is interrupted: waits of the simulator and of Octave, exchanges, long answers, ports, new worlds."""


class Desk:
    """Octave at a terminal, which prints a prompt."""

    def __init__(self, folder: Path, doors: Path, *, has_window: bool) -> None:
        folder.mkdir()
        own = {
            "KIKS_COMMAND": f"{sys.executable} -m kiks",
            "KIKS_WINDOW": str(int(has_window)),
            "BROWSER": "true",
            "XDG_RUNTIME_DIR": str(doors),
        }
        self.terminal = Terminal(folder, own)
        self.children: set[int] = set()
        self.slowest_s = 0.0
        self.terminal.type(f"PS1(['{PROMPT[:4]}' '{PROMPT[4:]}'])")
        self.terminal.wait_for(PROMPT)

    def do(self, line: str) -> None:
        """Type a line and wait for the prompt."""
        self.terminal.type(line)
        self.terminal.wait_for(PROMPT)
        self.children.update(self.terminal.sessions())

    def interrupt(self, line: str, after_s: float) -> None:
        """Type a line, and press Ctrl-C while it runs; measure how long the prompt takes."""
        self.terminal.type(f"disp(['be' 'gins']), {line}")
        self.terminal.wait_for("begins")
        time.sleep(after_s)
        self.children.update(self.terminal.sessions())
        begin_s = time.monotonic()
        self.terminal.press_ctrl_c()
        self.terminal.wait_for(PROMPT)
        self.slowest_s = max(self.slowest_s, time.monotonic() - begin_s)

    def check(self, line: str) -> None:
        """Check that the next command gets its own answer."""
        values = [self.terminal.ask(f"numel({name}(ref))") for name in ("kProximity", "kGetSpeed", "kGetStatus")]
        if values != ["8", "2", "6"]:
            raise Broken("lost", f"after Ctrl-C in {line!r} the next answers had {values} numbers", "a wrong answer")

    def leave(self) -> None:
        """End Octave, and see that it does."""
        self.children.update(self.terminal.sessions())
        self.terminal.type("kiks_quit(1), exit")
        deadline_s = time.monotonic() + HANDSHAKE_S + 10
        while any(state(child) != "Z" for child in (self.terminal.number, *self.children)):
            if time.monotonic() > deadline_s:
                left = [child for child in (self.terminal.number, *self.children) if state(child) != "Z"]
                for child in left:
                    with suppress(ProcessLookupError):
                        os.kill(child, signal.SIGKILL)
                raise Broken("hang", f"{len(left)} processes are left", "a process is left")
            with suppress(AssertionError):
                self.terminal.has_printed("")
            time.sleep(0.05)


def _interrupt_programs(desk: Desk, rng: random.Random) -> None:
    for _ in range(PRESSES):
        line = rng.choice(LINES)
        desk.interrupt(line, rng.uniform(0, LATEST_S))
        desk.do(f"kiks_kclose([]); {OPEN}")
        desk.check(line)


def _interrupt_starts(desk: Desk, rng: random.Random) -> None:
    for _ in range(STARTS):
        desk.interrupt(f"kiks, {OPEN} kiks_pause(1e5)", rng.uniform(0, LATEST_START_S))
        desk.do(f"kiks, kiks_kclose([]); {OPEN}")
        desk.check("kiks")
        desk.do("kiks_quit(1)")


Act = Callable[[Desk, random.Random], None]


def _play(act: Act, is_joined: bool, has_window: bool, rng: random.Random) -> NoReturn:
    """Interrupt an Octave, alone or beside another one.

    Raises:
        Broken: If an answer is wrong, or Octave or a process stays.
        Figure: How long the prompt took at most [s].
    """
    with tempfile.TemporaryDirectory(prefix="kiks-torture-") as name, ExitStack() as stack:
        folder = Path(name)
        doors = folder / "doors"
        doors.mkdir(mode=0o700)
        desks = [Desk(folder / "first", doors, has_window=has_window)]
        stack.enter_context(desks[0].terminal)
        try:
            if is_joined:
                desks[0].do(f"kiks, {OPEN}")
                desks.append(Desk(folder / "second", doors, has_window=has_window))
                stack.enter_context(desks[1].terminal)
                desks[1].do("kiks('--join')")
                desks[1].do(OPEN)
            elif act is _interrupt_programs:
                desks[0].do(f"kiks, {OPEN}")
            act(desks[-1], rng)
            for desk in reversed(desks):
                desk.leave()
        except AssertionError as error:
            raise Broken("hang", str(error), "Octave does not answer") from None
        raise Figure("prompt_s", desks[-1].slowest_s, PRESSES if act is _interrupt_programs else STARTS)


def _ready(act: Act, is_joined: bool, has_window: bool) -> Play:
    compile_engine()
    return partial(_play, act, is_joined, has_window)


def campaigns() -> Iterator[Campaign]:
    """Yield those for programs and for starts, where there is Octave."""
    if OCTAVE is None:
        return
    for name, act, is_joined, has_window, cases in (
        ("alone", _interrupt_programs, False, False, 5),
        ("joined", _interrupt_programs, True, False, 5),
        ("window", _interrupt_programs, False, True, 5),
        ("joined_window", _interrupt_programs, True, True, 5),
        ("start", _interrupt_starts, False, False, 10),
        ("start_window", _interrupt_starts, False, True, 4),
    ):
        yield Campaign(f"octave.{name}", cases, partial(_ready, act, is_joined, has_window), limit_s=60.0)
