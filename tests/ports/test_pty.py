import errno
import os
import shutil
import subprocess
import tempfile
import termios
from pathlib import Path

import pytest
import serial
from tests.served import GUARD_S, PROGRAMS, ask, called, fresh, opened, read_line, run_python, served
from tests.stranger import as_stranger, needs_root

from kiks.errors import LinkError
from kiks.ports.pty import PtyEndpoint, default_folder
from kiks.script.runner import run_here

CANONICAL = """
import os, sys, termios
port = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
settings = termios.tcgetattr(port)
settings[0], settings[1], settings[3] = termios.IGNCR, 0, termios.ICANON
settings[4] = settings[5] = termios.B38400
termios.tcsetattr(port, termios.TCSANOW, settings)
for command in (b"G,5,6\\n", b"H\\r", b"H\\r\\n"):
    os.write(port, command)
    print(os.read(port, 100))
"""


@pytest.fixture
def link(tmp_path: Path) -> str:
    return str(tmp_path / "robot")


def test_c_program_gives_the_same_run_as_the_python_program(link, tmp_path, capsys):
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no gcc to compile the C program with")
    program = tmp_path / "course"
    subprocess.run([compiler, "-O2", "-o", program, PROGRAMS / "course.c"], check=True, timeout=60)
    here = fresh()
    assert run_here(here, PROGRAMS / "course.py", ["/dev/ttyUSB0"], {}) == 0
    with served([PtyEndpoint(link)]) as run:
        done = called(program, link, check=True)
        assert done.stdout.strip() == capsys.readouterr().out.strip()
        assert run.sim.state_hash() == here.state_hash()


def test_canonical_client_is_served_like_a_raw_one_and_the_next_finds_a_raw_line_without_echo(link: str) -> None:
    with served([PtyEndpoint(link)]) as run:
        assert run_python(CANONICAL, link).split() == [r"b'g\n'", r"b'h,5,6\n'", r"b'h,5,6\n'"]
        run.wait_free()
        with opened(link) as port:
            iflag, oflag, _, lflag, speed, *_ = termios.tcgetattr(port)
            assert (iflag, oflag, lflag, speed) == (0, 0, 0, termios.B9600)
            # With an echo the robot would receive its own replies, and answer them before the second command.
            assert (ask(port, b"H\n"), ask(port, b"B\r")) == (b"h,5,6\r\n", b"b,5.02,5.01\r\n")
        assert run.sim.wires[0].line.baud == 9600


def test_settings_of_a_program_that_writes_nothing_stay(link: str) -> None:
    with served([PtyEndpoint(link)]) as run:
        with opened(link) as port:
            settings = termios.tcgetattr(port)
            settings[4] = settings[5] = termios.B19200
            termios.tcsetattr(port, termios.TCSANOW, settings)
        with opened(link) as port:
            assert ask(port, b"H\n") == b"h,0,0\r\n"
        assert run.sim.wires[0].line.baud == 19200


@pytest.mark.parametrize(("baud", "stop_bits"), [(9600, 2), (19200, 1), (38400, 2), (115200, 1), (12345, 2)])
def test_line_follows_the_speed_and_ignores_the_stop_bits(link: str, baud: int, stop_bits: int) -> None:
    with served([PtyEndpoint(link)]) as run, serial.Serial(link, baud, stopbits=stop_bits, timeout=GUARD_S) as port:
        for speed in (baud, 57600):
            port.baudrate = speed
            port.write(b"H\n")
            assert port.readline() == b"h,0,0\r\n"
            assert run.sim.wires[0].line.baud == speed


def test_hang_up_drops_unread_replies_and_an_unfinished_command(link: str) -> None:
    with served([PtyEndpoint(link)]) as run:
        with opened(link) as port:
            assert ask(port, b"D,5,5\n") == b"d\r\n"
            os.write(port, b"N\nB\nD,0,")
            run.wait_rounds(2)
        run.wait_free()
        with opened(link) as port:
            assert ask(port, b"N\n").startswith(b"n,")
            assert ask(port, b"E\n") != b"e,0,0\r\n"  # the robot drives on


def test_command_of_a_client_that_closes_at_once_acts(link: str) -> None:
    with served([PtyEndpoint(link)]) as run:
        with opened(link) as port:
            os.write(port, b"G,7,8\n")
        run.wait_for(lambda: run.sim.now_ns > 0)
        run.wait_free()
        with opened(link) as port:
            assert ask(port, b"H\n") == b"h,7,8\r\n"


@needs_root
def test_no_other_user_can_keep_a_link_from_its_owner() -> None:
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        endpoint = PtyEndpoint(f"{folder}/robot")
        (lock,) = {*os.listdir(folder)} - {"robot"}
        with as_stranger():
            for name in (lock, ".other.lock"):
                with pytest.raises(PermissionError):
                    os.open(f"{folder}/{name}", os.O_RDONLY | os.O_CREAT)
        endpoint.close()


def test_default_folder_belongs_to_the_user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert default_folder() == tmp_path / "kiks"
    assert (tmp_path / "kiks").stat().st_mode & 0o777 == 0o700
    (tmp_path / "kiks").rmdir()
    (tmp_path / "kiks").symlink_to(tmp_path)
    with pytest.raises(LinkError, match=r"must be a folder of yours, but .*Give a link of your own\."):
        default_folder()


def test_a_folder_that_others_can_write_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    runtime = tmp_path / "runtime"
    runtime.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (runtime / "kiks").mkdir()
    (runtime / "kiks").chmod(0o777)
    with pytest.raises(LinkError, match="others can write there"):
        default_folder()
    (runtime / "kiks").chmod(0o755)
    assert default_folder().stat().st_mode & 0o777 == 0o700
    runtime.chmod(0o777)
    assert default_folder() == tmp_path / f"kiks-{os.getuid()}", "other users could replace what is in that folder"
    runtime.chmod(0o700)
    (tmp_path / "link").symlink_to(runtime)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "link"))
    assert default_folder() == tmp_path / f"kiks-{os.getuid()}"


def test_link_of_a_dead_server_is_replaced_and_that_of_a_running_one_is_not(link: str) -> None:
    os.symlink("/dev/pts/123456", link)
    endpoint = PtyEndpoint(link)
    target = os.readlink(link)
    assert target != "/dev/pts/123456"
    with pytest.raises(LinkError, match=r"must be free, but a KiKS that is running has it\. Stop that one"):
        PtyEndpoint(link)
    assert os.readlink(link) == target
    endpoint.close()


def test_other_files_are_never_removed(link: str, tmp_path: Path) -> None:
    (tmp_path / "robot").write_text("precious")
    (tmp_path / "other").symlink_to(tmp_path / "robot")
    for path in (link, str(tmp_path / "other"), str(tmp_path)):
        with pytest.raises(LinkError, match=r"must not exist or be an old link to a terminal, but it is another file"):
            PtyEndpoint(path)
    assert (tmp_path / "other").read_text() == "precious"
    with pytest.raises(LinkError, match=r"must be in a folder that you can write to, but it is not \(No such file"):
        PtyEndpoint(tmp_path / "nowhere" / "robot")


def test_link_that_was_taken_over_is_left_alone(link: str) -> None:
    endpoint = PtyEndpoint(link)
    os.unlink(link)
    os.symlink("/dev/null", link)
    endpoint.close()
    assert os.readlink(link) == "/dev/null"


def test_terminal_that_a_client_has_locked_is_replaced(link: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise OSError(errno.EBUSY, "busy")

    endpoint = PtyEndpoint(link)
    endpoint.accept()
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", refuse)
        endpoint.renew()
    with opened(link) as port:
        os.write(port, b"x")
        channel = endpoint.accept()
        assert channel.read() == b"x"
        channel.write(b"y\n")
        assert read_line(port) == b"y\n"
    endpoint.close()
