"""`kiks desk`, and `--desk` of the other commands."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import HTTPCookieProcessor, build_opener, urlopen

import pytest
from tests import forked
from tests.at_length import at_length, cases
from tests.cli.test_cli import state_of
from tests.forked import kiks_command
from tests.guard import GUARD_S
from tests.served import PROGRAMS
from websockets.sync.client import connect

from kiks.desk.screen import has_screen

pytestmark = pytest.mark.slow
DRIVE = str(PROGRAMS / "drive.py")
KIKS = (sys.executable, "-m", "kiks")


@contextmanager
def started(*words: str, folder: Path, command: Sequence[str] = KIKS) -> Iterator[tuple[subprocess.Popen, IO[str]]]:
    """Start the command; its processes end with the test."""
    env = {**os.environ, "PYTHONUNBUFFERED": "1", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    with subprocess.Popen([*command, *words], start_new_session=True, cwd=folder, env=env, **pipes) as process:
        try:
            yield process, process.stdout
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.skipif(sys.platform in ("win32", "darwin"), reason="here each process has a screen")
@pytest.mark.parametrize("names", [(), ("DISPLAY",), ("WAYLAND_DISPLAY",), ("DISPLAY", "WAYLAND_DISPLAY")])
def test_a_screen_of_either_kind_is_found(names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.setenv(name, ":0" if name in names else "")
    assert has_screen() == bool(names)


def line_with(output: IO[str], text: str) -> str:
    for line in output:
        if text in line:
            return line
    raise AssertionError(f"nothing was said of {text!r}")


def url_of(output: IO[str], scheme: str = "http") -> str:
    return re.search(rf"{scheme}://\S+", line_with(output, f"{scheme}://"))[0]


def stop(process: subprocess.Popen[str], told: str = "Stopped after") -> None:
    """Press Ctrl-C, and check that the command says so and ends well."""
    process.send_signal(signal.SIGINT)
    assert line_with(process.stdout, told)
    assert process.wait(GUARD_S) == 0


@pytest.mark.parametrize("host", cases(["127.0.0.1", "0.0.0.0"]))
def test_desk_serves_a_page_to_the_token_alone_and_ends_with_ctrl_c(host: str, tmp_path: Path) -> None:
    # Programs of a project lie beside it, wherever the desk saves.
    for name in ("own", "set"):
        (tmp_path / name).mkdir()
    (tmp_path / "set" / "judge.py").write_text("def supervise(sim):\n    yield 1\n")
    project = 'kiks = 1\nsupervisor = "judge.py"\n[walls]\nsize_mm = [400, 400]\n[[robot]]\n'
    (tmp_path / "set" / "it.kiks").write_text(project)
    words = ("desk", "set/it.kiks", "--folder", "own", "--no-browser", "--port", "0", "--host", host)
    with started(*words, folder=tmp_path) as (process, output):
        url = url_of(output)
        assert "0.0.0.0" not in url
        bare, token = url.split("?token=")
        assert len(token) >= 32
        for wrong in (bare, f"{bare}?token=guess", f"{bare}/arena/1.png"):
            with pytest.raises(HTTPError, match="403"):
                urlopen(wrong, timeout=GUARD_S)
        with build_opener(HTTPCookieProcessor()).open(url, timeout=GUARD_S) as answer:
            assert answer.status == 200
            assert "token" not in answer.url
            assert b"KiKS" in answer.read()
        stop(process)


def test_run_with_a_desk_equals_run_without(tmp_path: Path) -> None:
    words = ("--seed", "3", DRIVE, "COM1", "5", "3", "5")
    with started("run", "--desk", "--no-wait", *words, folder=tmp_path, command=kiks_command()) as (_, output):
        url_of(output)
        shown = state_of(line_with(output, "s simulated"))
    assert shown == state_of(forked.run("run", *words).stderr)


def show_page(url: str) -> None:
    """Receive a frame and acknowledge it, as a page does."""
    cookies = HTTPCookieProcessor()
    with build_opener(cookies).open(url, timeout=GUARD_S) as page:
        parts = urlsplit(page.url)
    feed = f"ws://{parts.netloc}{parts.path.rstrip('/')}/feed"
    cookie = "; ".join(f"{each.name}={each.value}" for each in cookies.cookiejar)
    with connect(feed, compression=None, additional_headers={"Cookie": cookie}, open_timeout=GUARD_S) as socket:
        while not isinstance(socket.recv(GUARD_S), bytes):
            pass
        socket.send('{"kind": "ack"}')


@at_length
@pytest.mark.parametrize("words", [("run", "--desk"), ("desk", "--port", "0", "--no-browser")])
def test_programs_begin_when_a_page_shows_the_world(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "tells.py").write_text("open('begun', 'w').close()\nimport time\ntime.sleep(1)\n")
    with started(*words, "tells.py", folder=tmp_path) as (process, output):
        url = url_of(output)
        assert line_with(output, "The run begins when a page shows it")
        assert not (tmp_path / "begun").exists()
        show_page(url)
        if words[0] == "run":
            assert line_with(output, "1.000 s simulated")
            assert (tmp_path / "begun").exists()
        # The last state stays until a person lets the world go on.
        stop(process, "Stopped after 1.0 s" if words[0] == "run" else "Stopped after")


@at_length
@pytest.mark.parametrize("words", [("run", "--desk", DRIVE, "COM1", "5", "3", "5"), ("demo", "avoid", "--desk")])
def test_ctrl_c_ends_waiting_for_a_page(words: tuple[str, ...], tmp_path: Path) -> None:
    with started(*words, folder=tmp_path) as (process, output):
        assert line_with(output, "The run begins when a page shows it")
        stop(process, "Stopped after 0.0 s")


@pytest.mark.parametrize("name", cases(["soccer", "avoid"]))
def test_demonstration_on_a_desk(name: str, tmp_path: Path) -> None:
    words, opener = ("demo", name, "--desk", "--no-wait"), build_opener(HTTPCookieProcessor())
    with started(*words, folder=tmp_path, command=kiks_command()) as (_, output):
        assert opener.open(url_of(output), timeout=GUARD_S).status == 200


@pytest.mark.parametrize("thinking", cases(["live", "none"]))
def test_served_robots_on_a_desk(thinking: str, tmp_path: Path) -> None:
    import serial

    words = ("serve", "--desk", "--thinking", thinking, "--tcp", "0", "--no-pty")
    with started(*words, folder=tmp_path) as (process, output):
        url_of(output)
        with serial.serial_for_url(url_of(output, "socket"), timeout=GUARD_S) as port:
            port.write(b"H\n")
            assert port.readline() == b"h,0,0\r\n"
        stop(process)


@pytest.mark.parametrize(
    ("words", "message"),
    cases(
        [
            (("run", "--thinking", "replay:nowhere", DRIVE, DRIVE), "replay file 'nowhere.1' must exist"),
            (("--folder", "nowhere"), "--folder must be a folder"),
            (("--host", "192.0.2.1"), "the desk must be able to listen"),
            (("--arena", "nowhere.kiks"), "nowhere.kiks"),
            (("--robots", "3", "--robot", "khepera", "--robot", "khepera_ii"), "robot must name one kind for all"),
            (("--speed", "-1"), "speed must be at least 0.001, but it was -1"),
            (("--host", "no such host"), "the desk must be able to listen"),
        ],
        4,
    ),
)
def test_errors_are_one_clear_line_before_a_page_is_waited_for(words: tuple, message: str, tmp_path: Path) -> None:
    command = ("run", "--desk") if words[0] == "run" else ("desk", "--no-browser", "--port", "0", words[0])
    result = forked.run(*command, *words[1:], cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert "http://" not in result.stdout


@at_length
def test_a_recording_is_shown_from_a_time_on(tmp_path: Path) -> None:
    recorded = forked.run("run", "--record", "run.mcap", DRIVE, "COM1", "5", "3", "5", cwd=tmp_path)
    assert recorded.returncode == 0, recorded.stderr
    with started("replay", "run.mcap", "--start", "0.1", folder=tmp_path) as (process, output):
        url = url_of(output)
        assert line_with(output, "The run begins when a page shows it")
        show_page(url)
        stop(process)
    late = forked.run("replay", "run.mcap", "--start", "99", cwd=tmp_path)
    assert late.returncode == 2
    assert "time_s must be from 0 to" in late.stderr
