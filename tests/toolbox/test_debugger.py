"""Octave's debugger: while a person is at its prompt, the simulated world stands."""

import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.forked import kiks_command
from tests.matlab.octave import needs_octave
from tests.matlab.terminal import Terminal
from tests.toolbox.test_session_clients import Asker, running

from kiks.toolbox.session import Session
from kiks.toolbox.session_client import UNTOLD_NS

PROMPT = r"(debug|keyboard)> "

PROGRAM = """
{begin}
kSetSpeed(ref, 5, 5);
for k = 1:3
  before = kiks_ktime(-1);
  reading = kProximity(ref)(1);
  {stop}
  kSetSpeed(ref, 4, 5);
  printf('%d sees %d\\n', k, reading);
  printf('%d took %.6f s\\n', k, kiks_ktime(-1) - before);
end
{end}
"""

SEEN = """
function seen()
  % Say at each tenth call, once a second, that a person is at the prompt of the debugger.
  persistent count
  if isempty(count) || ~isdebugmode()
    count = 0;
  end
  count = count + 1;
  if mod(count, 10) == 0
    disp('seen');
    fflush(stdout);
  end
end
"""

OTHER = """
ref = kiks_kopen();
for k = 1:100
  kProximity(ref);
end
"""


def write(folder: Path, stop: str, begin: str = "", end: str = "") -> None:
    begin = f"{begin} ref = kiks_kopen(); add_input_event_hook(@seen);"
    (folder / "prog.m").write_text(PROGRAM.format(begin=begin, stop=stop, end=end))
    (folder / "seen.m").write_text(SEEN)
    (folder / "other.m").write_text(OTHER)


def stand(terminal: Terminal, seconds: int = 1) -> float:
    """Wait until a prompt of the debugger has stood for a while; return for how long at least [s]."""
    terminal.wait_for(PROMPT)
    begin_s = time.monotonic()
    for _ in range(seconds):
        terminal.wait_for("seen")
    return time.monotonic() - begin_s


def ran(folder: Path, *words: str, stops: bool) -> tuple[list[str], str]:
    """Run `kiks run`, with one stop at `keyboard` or none; return what the program prints, and the state."""
    write(folder, "if k == 2, keyboard, end" if stops else "")
    text = ""
    with Terminal(folder, command=[*kiks_command(), "run", *words]) as terminal:
        if stops:
            text += terminal.wait_for(r"(?s).*1 took") + terminal.wait_for(r".*s\b")
            stand(terminal, seconds=3)
            terminal.type("dbcont")
        text += terminal.wait_for(r"(?s).*3 took") + terminal.wait_for(r".*s\b")
        state = terminal.wait_for(r"state \w+")
    return re.findall(r"\d (?:sees|took) [\d.]+", text), state


@pytest.mark.parametrize("thinking", ["none", "fixed:5"])
@needs_octave
@pytest.mark.slow
def test_a_run_that_was_stopped_is_the_same(thinking: str, tmp_path: Path) -> None:
    """Also for another program, which waits meanwhile, and for longer than its patience."""
    runs = [ran(tmp_path, "--thinking", thinking, "prog.m", "other.m", stops=stops) for stops in (False, True)]
    assert runs[0] == runs[1]
    assert len(runs[0][0]) == 6


@needs_octave
@pytest.mark.slow
def test_time_at_the_prompt_is_no_measured_thinking(tmp_path: Path) -> None:
    write(tmp_path, "if k == 2, keyboard, end")
    with Terminal(tmp_path, command=[*kiks_command(), "run", "--thinking", "live", "prog.m"]) as terminal:
        stood_s = stand(terminal)
        terminal.type("numel(kProximity(ref))")  # a command like any other
        terminal.wait_for("ans = 8")
        stood_s += stand(terminal)
        terminal.type("dbcont")
        assert float(terminal.wait_for(r"2 took [\d.]+").split()[2]) < stood_s / 2


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Terminal]:
    write(tmp_path, "", "kiks(); ", "disp(['state ' kiks('--state')]); kiks_kclose(ref); kiks_quit(1);")
    with Terminal(tmp_path, {"KIKS_COMMAND": " ".join(kiks_command())}, edits_lines=True) as terminal:
        yield terminal


@needs_octave
@pytest.mark.slow
def test_a_stop_in_a_session_changes_nothing(session: Terminal) -> None:
    session.type("prog")
    state = session.wait_for(r"state \w{16}")
    session.type("dbstop in prog at 7")
    session.type("prog")
    for step in ("dbstep", "dbcont", "return", "dbcont"):
        stand(session)
        session.type(step)
    assert session.wait_for(r"state \w{16}") == state


@needs_octave
@pytest.mark.slow
def test_time_at_the_prompt_of_a_session_is_no_measured_thinking(session: Terminal) -> None:
    session.type("KIKS_THINKING = 'live'; dbstop in prog at 7")
    session.type("prog")
    for number in (1, 2, 3):
        stood_s = stand(session)
        session.type("dbcont")
        assert float(session.wait_for(rf"{number} took [\d.]+").split()[2]) < stood_s / 2


# ---- requests, as the toolbox sends them ----


def test_a_program_has_thought_what_it_says_after_it_stood(monkeypatch: pytest.MonkeyPatch) -> None:
    now_ns = [0]
    monkeypatch.setattr("kiks.clock.thinking.perf_counter_ns", lambda: now_ns[0])
    with running(Session()) as each:
        ask = Asker(each)
        ask("set thinking live", "world default", "open 1 9600", "ask 1 N")
        before_s = float(ask("time 1"))
        now_ns[0] += UNTOLD_NS + 1
        client = ask.client
        assert client.live(1000)
        ask("poll stands")
        now_ns[0] += 1_000_000_000_000
        assert not client.live(1000)
        ask("stood 0.25")
        assert float(ask("time 1")) == pytest.approx(before_s + 0.25, abs=1e-5)
        now_ns[0] += 500_000_000
        assert client.live(1000)
        assert float(ask("time 1")) == pytest.approx(before_s + 0.75, abs=1e-5)
        assert "a time must be 1 finite numbers" in ask.refused("stood x y")
