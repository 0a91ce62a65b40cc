"""`kiks run --debug`: an editor stops a run, and goes back in it; what comes then is what came before."""

from __future__ import annotations

import json
import os
import pty
import random
import re
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from tests.debugging.dap_client import Act, Editor, Stop, connect, free_port
from tests.debugging.test_debuggers import PROGRAMS, TURNS, lines, plain, stay

from kiks import Arena, Simulation
from kiks.debug.code_lines import code_lines
from kiks.debug.session import back_of
from kiks.errors import ParameterError
from kiks.script.history import LineHistory
from kiks.sim.judge import Condition

WANDER = """\
import random
import serial

port = serial.Serial("/dev/ttyUSB0", 9600, timeout=1)
random.seed(4)


def ask(command):
    port.write(command + b"\\n")
    return port.readline()


turns = 0
for step in range(160):
    values = [int(each) for each in ask(b"N").split(b",")[1:]]
    near = values[0]  # not all that it could look at
    if near > 1000 and random.random() < 0.5:
        speeds = 5, -5
        turns += 1
    else:
        speeds = 8, 8
    ask(b"D,%d,%d" % speeds)
print("turns", turns)
"""
"""A program that meets a wall."""


def look_and_go_on(stop: Stop) -> str:
    """Look where a program stands, and let it go on."""
    assert stop.line
    assert stop.thread_name
    return "continue"


class Debugged:
    """A run of `kiks run --debug` with an editor.

    Attributes:
        stops: Its stops.
        output: What it has printed.
        code: Its exit code.
    """

    def __init__(
        self, folder: Path, words: list[str], breakpoints: dict[str, list[Any]], act: Act = look_and_go_on
    ) -> None:
        port = free_port()
        editor = Editor({folder / name: each for name, each in breakpoints.items()}, act)
        command = [sys.executable, "-m", "kiks", "run", "--debug", str(port), "--seed", "3", *words]
        with subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, text=True
        ) as run:
            try:
                editor.attach_to(port)
                output = run.communicate(timeout=60)[0]
            finally:
                run.kill()
        self.stops, self.code = editor.stops, run.returncode
        self.output = "".join(line for line in output.splitlines(keepends=True) if "waiting for an editor" not in line)


@pytest.fixture
def wander(tmp_path: Path) -> Path:
    """Return the folder of `wander.py`."""
    (tmp_path / "wander.py").write_text(WANDER)
    return tmp_path


def in_turn(*acts: Callable[[Stop], str]) -> Act:
    """Return what does one thing at each stop, and goes on at the end."""
    left = list(acts)
    return lambda stop: left.pop(0)(stop) if left else "continue"


def request(name: str) -> Callable[[Stop], str]:
    return lambda _: name


def typed(text: str) -> Callable[[Stop], str]:
    """Return what types a command into the console of the editor, which goes back by itself."""

    def act(stop: Stop) -> str:
        stop.evaluate(text, "repl")
        return "threads"

    return act


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_that_an_editor_stops_twenty_times_does_what_it_does_alone(tmp_path: Path, name: str) -> None:
    text, line = PROGRAMS[name]
    (tmp_path / "program.py").write_text(text)
    run = Debugged(tmp_path, ["program.py"], {"program.py": [line]})
    assert [stop.line for stop in run.stops] == [line] * 20
    assert lines(run.output) == lines(plain(tmp_path, "--seed", "3", "program.py"))
    assert run.code == 0


def test_two_programs_stop_one_after_the_other(tmp_path: Path) -> None:
    for name in ("one.py", "two.py"):
        (tmp_path / name).write_text(TURNS)
    words = ["--patience", "0.5", "one.py", "two.py"]
    run = Debugged(tmp_path, words, {"one.py": [6], "two.py": [7]}, lambda stop: (stop.thread_name, stay(stop))[1])
    assert len(run.stops) == 40
    assert {stop.thread_name for stop in run.stops} == {
        "program 1 (one.py): MainThread",
        "program 2 (two.py): MainThread",
    }
    assert lines(run.output) == lines(plain(tmp_path, "--seed", "3", *words))


def test_live_thinking_counts_no_stop_and_is_the_same_when_one_goes_back(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(TURNS)
    seen: list[str] = []

    def note(then: str) -> Callable[[Stop], str]:
        return lambda stop: (seen.append(stop.evaluate("(count, time.time())")), then)[1]

    acts = in_turn(*[request("continue")] * 9, note("next"), note("stepBack"), note("continue"))
    run = Debugged(tmp_path, ["--thinking", "live", "program.py"], {"program.py": [6]}, acts)
    took = re.search(r"took (\S+)", run.output)
    assert took is not None
    assert float(took[1]) < 1
    assert seen[0] == seen[2] != seen[1]


def test_random_steps_back_find_what_was_there(wander: Path) -> None:
    """Steps are walked once, then some are taken back, from the last one on, by chance; each is what it was."""
    chance, trace, compared = random.Random(5), [], []

    def look(stop: Stop) -> tuple[int, dict[str, str], dict[str, str]]:
        variables = {
            name: stop.local[name] for name in ("turns", "step", "near", "values", "speeds") if name in stop.local
        }
        return stop.line, variables, stop.scope("Robot")

    def act(stop: Stop) -> str:
        if stop.reason == "goto":
            place = compared[-1][0]
            compared[-1] = place, look(stop)
        elif not compared:
            trace.append(look(stop))
            if len(trace) < 30:
                return "next"
            compared.append((len(trace) - 1, look(stop)))
        if len(compared) < 9:
            place = compared[-1][0]
            if place > 0 and chance.random() < 0.8:
                compared.append((place - 1, ()))
                return "stepBack"
            if place < len(trace) - 1:
                compared.append((place + 1, ()))
                return "next"
        return "continue"

    def acting(stop: Stop) -> str:
        if compared and stop.reason == "step":
            place = compared[-1][0]
            compared[-1] = place, look(stop)
        return act(stop)

    Debugged(wander, ["wander.py"], {"wander.py": [{"line": 16, "hitCondition": "==40"}]}, acting)
    assert len(compared) == 9
    for place, found in compared:
        assert found == trace[place]


def test_back_leads_to_a_line_a_breakpoint_a_time_and_a_formula(wander: Path) -> None:
    seen: dict[str, str] = {}

    def note(name: str, then: Callable[[Stop], str]) -> Callable[[Stop], str]:
        def act(stop: Stop) -> str:
            robot = stop.scope("Robot")
            seen[name] = f"{stop.reason} {stop.line} at {float(robot['time_s']):.2f}"
            return then(stop)

        return act

    act = in_turn(
        note("begin", typed("back 21")),
        note("line", typed("when time_s >= 1")),
        note("time", typed("rback")),
        note("start", request("continue")),
        note("end", typed("when contacts == 1")),
        note("contact", request("continue")),
    )
    run = Debugged(wander, ["wander.py"], {"wander.py": [23]}, act)
    assert seen["line"].startswith("goto 21 at ")
    assert re.fullmatch(r"goto \d+ at (0\.9[0-9]|1\.00)", seen["time"])
    # No breakpoint was there before: so it is the first line.
    assert seen["start"] == "goto 1 at 0.00"
    assert seen["begin"] == seen["end"]
    assert "1 contact" in run.output
    assert 1 < float(seen["contact"].rpartition(" ")[2]) < float(seen["end"].rpartition(" ")[2])
    assert lines(run.output) == lines(plain(wander, "--seed", "3", "wander.py"))


def test_reverse_continue_heeds_conditions(wander: Path) -> None:
    steps: list[str] = []

    def note(then: str) -> Callable[[Stop], str]:
        return lambda stop: (steps.append(stop.local["step"]), then)[1]

    act = in_turn(note("continue"), note("continue"), note("reverseContinue"), note("reverseContinue"), note("next"))
    Debugged(wander, ["wander.py"], {"wander.py": [{"line": 16, "condition": "int(step) % 10 == 7"}]}, act)
    assert steps[:5] == ["7", "17", "27", "17", "7"]


def test_what_cannot_be_made_again_is_not_gone_back(wander: Path) -> None:
    said: list[str] = []

    def change(stop: Stop) -> str:
        reference = stop.session.ask("scopes", frameId=stop.frames[0]["id"])["scopes"][0]["variablesReference"]
        stop.session.ask("setVariable", variablesReference=reference, name="turns", value="40 + 2")
        assert stop.evaluate("turns") == "42"
        return "stepBack"

    def bad_formula(stop: Stop) -> str:
        with pytest.raises(RuntimeError):
            stop.evaluate("1 / 0")
        return typed("when contact = 1")(stop)

    def hear(stop: Stop) -> str:
        said.append(stop.reason)
        return "continue"

    run = Debugged(
        wander,
        ["wander.py"],
        {"wander.py": [{"line": 16, "hitCondition": "3"}, 23]},
        in_turn(bad_formula, change, hear),
    )
    assert "not repeatable: a person has changed the program in a debugger" in run.output
    assert run.code == 0


def test_an_uncaught_exception_stops_where_it_was_raised(tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text(TURNS + "def half(number):\n    return number / 0\nhalf(4)\n")
    told: list[Any] = []

    def act(stop: Stop) -> str:
        told.append((stop.reason, stop.line, stop.session.ask("exceptionInfo", threadId=stop.thread)["exceptionId"]))
        told.append(stop.local)
        return "stepBack"

    def then(stop: Stop) -> str:
        told.append((stop.reason, stop.line, stop.local))
        return "continue"

    run = Debugged(tmp_path, ["program.py"], {}, in_turn(act, then))
    assert told == [("exception", 10, "ZeroDivisionError"), {"number": "4"}, ("goto", 10, {"number": "4"})]
    assert "ZeroDivisionError" in run.output
    assert run.code == 1


def test_pdb_at_the_terminal_goes_back_too(tmp_path: Path) -> None:
    text = TURNS.replace(
        "    reply = port.readline()\n", "    reply = port.readline()\n    if count == 3:\n        breakpoint()\n"
    )
    (tmp_path / "program.py").write_text(text)
    keyboard, terminal = pty.openpty()
    words = [sys.executable, "-m", "kiks", "run", "--debug", str(free_port()), "--no-wait", "--seed", "3", "program.py"]
    run = subprocess.Popen(words, cwd=tmp_path, stdin=terminal, stdout=terminal, stderr=subprocess.STDOUT)
    os.close(terminal)
    heard = b""

    def wait_for(prompt: bytes) -> bytes:
        nonlocal heard
        while prompt not in heard:
            heard += os.read(keyboard, 4096)
        before, heard = heard.split(prompt, 1)
        return before

    answers = [wait_for(b"(Pdb) ")]
    for command in (
        "p count",
        "back",
        "back 6",
        "when time_s >= 0.03",
        "p count",
        "when time_s > 9",
        "when x",
        "rback",
        "c",
    ):
        os.write(keyboard, command.encode() + b"\n")
        answers.append(wait_for(b"(Pdb) "))
    os.write(keyboard, b"c\n")
    rest = wait_for(b"state ").decode()
    os.close(keyboard)
    assert run.wait(60) == 0
    # Each begins with what was typed.
    said = [each.decode().replace("\r", "").partition("\n")[2] for each in answers]
    places = [re.sub(r"> .*/program\.py", "", each).partition("\n")[0] for each in said]
    assert places[1:4] == ["3", "(8)<module>()", "(6)<module>()"]
    assert places[4:6] == ["(7)<module>()", "0"]
    assert places[6] == "*** 'time_s > 9' has not become true in this run."
    assert places[7].startswith("*** the formula must name measures")
    assert places[8:] == ["(1)<module>()", "(9)<module>()"]
    assert "took 0.5" in rest


def test_an_adapter_hears_editors_alone(wander: Path) -> None:
    port = free_port()
    words = [sys.executable, "-m", "kiks", "run", "--debug", str(port), "--no-wait", "wander.py"]
    with subprocess.Popen(words, cwd=wander, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as run:
        evil = json.dumps({"seq": 1, "type": "request", "command": "terminate"})
        page = f"POST / HTTP/1.1\r\nContent-Length: {len(evil)}\r\n\r\n{evil}".encode()
        for data in (page, b"Content-Length: 99999999999\r\n\r\n", b"Content-Length: 2\r\n\r\n[]", b"\0" * 5000):
            with connect("127.0.0.1", port) as link:
                link.sendall(data)
                with suppress(ConnectionError):
                    assert link.recv(100) == b""
        output = run.communicate(timeout=60)[0]
    assert "turns" in output
    assert run.returncode == 0


def test_the_lines_of_a_run_have_numbers() -> None:
    history = LineHistory()
    base = history.base_of("a.py")
    # Of each line: its number, its depth, its time and thread.
    for line, depth, time_ns, thread in (
        (1, 1, 0, 1),
        (2, 1, 0, 1),
        (7, 2, 5, 1),
        (9, 1, 5, 2),
        (8, 2, 9, 1),
        (3, 1, 9, 1),
    ):
        history.places.append(base + line)
        history.depths.append(depth)
        history.mark(0, time_ns, thread)
    assert history.count == 6
    assert history.place(3) == ("a.py", 7)
    assert history.last_before(6, 1) == 2  # not in the function, nor in the other thread
    assert history.last_before(5, 2) == 3
    assert history.last_before(6, 0, {base + 9}) == 4
    assert history.last_before(1, 1) == 0
    assert [history.last_at(time_ns) for time_ns in (0, 4, 5, 8, 100)] == [2, 2, 4, 4, 6]
    assert [history.time_ns(count) for count in (1, 3, 6)] == [0, 5, 9]


def test_a_history_keeps_its_numbers_when_it_drops_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kiks.script.history.LINES_MAX", 10)
    history = LineHistory()
    base = history.base_of("a.py")
    for line in range(1, 12):
        history.places.append(base + line)
        history.depths.append(1)
        history.mark(0, line, 1)
    history.trim()
    assert (history.count, history.dropped) == (11, 5)
    assert history.place(11) == ("a.py", 11)
    assert history.last_before(7, 1) == 6
    assert history.last_before(6, 1) == 0
    assert history.time_ns(9) == 9


def test_breakpoints_move_to_code(tmp_path: Path) -> None:
    file = tmp_path / "a.py"
    file.write_text('"""Text."""\n\ndef f(x):\n    # no code\n    return (\n        x\n    )\n')
    assert code_lines(file) == [1, 3, 5, 6]
    assert code_lines(tmp_path / "none.py") == []
    file.write_text("def (")
    assert code_lines(file) == []


def test_commands_to_go_back() -> None:
    assert back_of(" back ") == {"is_step": True}
    assert back_of("back 12") == {"line": 12}
    assert back_of("back x") is None
    assert back_of("rback") == {"is_to_breakpoint": True}
    assert back_of("when") is None
    assert back_of("backs = 3") is None


def test_a_condition_is_found_at_its_last_beginning() -> None:
    sim = Simulation(Arena.box(500, 500), seed=1)
    port = sim.port(1)
    port.write(b"D,10,10\n")
    condition = Condition("path_mm > 50", 1, sim)
    for wait_s in condition.looks(sim):
        if condition.before_ns is not None:
            break
        sim.run(wait_s)
    assert sim.time_s * 1e9 - condition.before_ns == pytest.approx(1e7)
    with pytest.raises(ParameterError, match="proximity"):
        Condition("proximity(9) > 1", 1, sim)
    assert Condition("proximity(2) > 500 or light(3) < 10", 1, sim).before_ns is None
