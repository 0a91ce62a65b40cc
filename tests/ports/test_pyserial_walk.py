"""Simulated ports against pyserial itself on a pseudo-terminal, method by method: bytes, exceptions and times."""

from __future__ import annotations

import errno
import os
import pickle
import re
import select
import struct
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import serial
from serial import serialposix
from tests.ports.pyserial_scripts import BAUD, CHARACTER_S, SCRIPTS, SETTINGS, Script, perform
from tests.served import GUARD_S

import kiks
from kiks.script.runner import run_here
from kiks.sim.port import VirtualPort

NOISE_S = 0.04
"""By how much a real run may differ [s]; one that differs by more was disturbed and is repeated."""

REPEATS = 4
"""How often a real run is repeated that said something else than the simulated ones."""

ERROR = re.compile(r"[A-Z]\w+: ")
"""What a program says that ends with an exception."""

NOT_IN_MEMORY = set(
    re.findall(
        r"\w+",
        """
    BAUDRATES BAUDRATE_CONSTANTS BYTESIZES PARITIES STOPBITS
    applySettingsDict apply_settings getSettingsDict get_settings bytesize parity stopbits xonxoff rtscts dsrdtr
    exclusive interCharTimeout inter_byte_timeout rs485_mode writeTimeout port setPort open
    break_condition cd cts dsr dtr getCD getCTS getDSR getRI ri rts sendBreak send_break setDTR setRTS
    set_input_flow_control set_low_latency_mode set_output_flow_control
    fileno isatty nonblocking flushInput flushOutput inWaiting isOpen
    closed readable seek seekable tell truncate writable
    """,
    )
)
"""What the port in memory does not have: settings that change nothing, old names, and what concerns files."""

Answer = tuple[object, float]
"""What a program has said, and how long it took [s]."""

BUFFER = 4096
"""Characters in the buffer of a serial driver."""

REPLIES = {b"H": b"h,0,0\r\n", b"G": b"g\r\n"}


class Robot:
    """A robot at the other end of a pseudo-terminal: it takes and sends each character at its time."""

    def __init__(self) -> None:
        self.end, self.kept = os.openpty()
        tty.setraw(self.end)
        tty.setraw(self.kept)
        self.name = os.ttyname(self.kept)
        self._stopped, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        line, received_s, sent_s, sending = b"", 0.0, 0.0, []
        while True:
            wait_s = max(sending[0][0] - time.monotonic(), 0) if sending else None
            ready = select.select([self.end, self._stopped], [], [], wait_s)[0]
            if self._stopped in ready:
                return
            if not ready:
                os.write(self.end, sending.pop(0)[1])
                continue
            for code in os.read(self.end, BUFFER):
                received_s = max(received_s, time.monotonic()) + CHARACTER_S
                line += bytes([code])
                if code == ord("\n"):
                    sent_s = max(sent_s, received_s)
                    for character in REPLIES.get(line[:1], b""):
                        sent_s += CHARACTER_S
                        sending.append((sent_s, bytes([character])))
                    line = b""

    def close(self) -> None:
        os.write(self._stop, b"x")
        self._thread.join()
        for descriptor in (self.end, self.kept, self._stopped, self._stop):
            os.close(descriptor)


class Driver:
    """What a pseudo-terminal lacks of a serial driver: a buffer that empties at the line's speed, and control lines."""

    def __init__(self) -> None:
        self._sent_s: dict[int, float] = {}

    def open(self, name: str, flags: int) -> int:
        descriptor = os.open(name, flags)
        self._sent_s.pop(descriptor, None)  # of another port, which had this number before
        return descriptor

    def _waiting(self, descriptor: int) -> int:
        left_s = self._sent_s.get(descriptor, 0) - time.monotonic()
        return max(-int(-left_s // CHARACTER_S), 0)

    def write(self, descriptor: int, data: bytes) -> int:
        if not os.isatty(descriptor):
            return os.write(descriptor, data)
        room = min(BUFFER - self._waiting(descriptor), len(data))
        if not room:
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        os.write(descriptor, data[:room])
        self._sent_s[descriptor] = max(self._sent_s.get(descriptor, 0), time.monotonic()) + room * CHARACTER_S
        return room

    def select(self, reading: list[int], writing: list[int], special: list[int], wait_s: float | None) -> Any:
        if not writing:
            return select.select(reading, writing, special, wait_s)
        end_s = None if wait_s is None else time.monotonic() + wait_s
        while self._waiting(writing[0]) >= BUFFER and (end_s is None or time.monotonic() < end_s):
            if select.select(reading, [], [], 0.005)[0]:
                break
        ready = select.select(reading, [], [], 0)[0]
        return ready, writing if self._waiting(writing[0]) < BUFFER else [], []

    def ioctl(self, descriptor: Any, request: int, argument: Any = 0) -> Any:
        os.fstat(descriptor) if isinstance(descriptor, int) else serialposix_fcntl.ioctl(descriptor, request, argument)
        if request == serialposix.TIOCOUTQ:
            return struct.pack("I", self._waiting(descriptor))
        if request == serialposix.TIOCMGET:
            return struct.pack("I", serialposix.TIOCM_CTS | serialposix.TIOCM_DSR | serialposix.TIOCM_CD)
        if request in (termios.FIONREAD, serialposix.TIOCGRS485):
            return serialposix_fcntl.ioctl(descriptor, request, argument)
        return argument

    def tcsetattr(self, descriptor: int, when: int, attributes: list[Any]) -> None:
        with suppress(termios.error):  # a pseudo-terminal has eight bits and no parity
            termios.tcsetattr(descriptor, when, attributes)

    def tcdrain(self, descriptor: int) -> None:
        time.sleep(max(self._sent_s.get(descriptor, 0) - time.monotonic(), 0))

    def tcsendbreak(self, descriptor: int, duration: int) -> None:
        # glibc and Linux: a quarter of a second, or that many milliseconds, rounded up to tenths of a second.
        time.sleep(-(-duration // 100) * 0.1 if duration else 0.25)


serialposix_fcntl = serialposix.fcntl


def beside(module: Any, **others: Any) -> SimpleNamespace:
    return SimpleNamespace(**{**vars(module), **others})


@pytest.fixture(scope="module", autouse=True)
def _driver() -> Iterator[None]:
    driver = Driver()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(serialposix, "os", beside(os, open=driver.open, write=driver.write))
        patch.setattr(serialposix, "select", beside(select, select=driver.select))
        patch.setattr(serialposix, "fcntl", beside(serialposix_fcntl, ioctl=driver.ioctl))
        own = {name: getattr(driver, name) for name in ("tcsetattr", "tcdrain", "tcsendbreak")}
        patch.setattr(serialposix, "termios", beside(termios, **own))
        yield


# ---- the four kinds of ports ----


def later(delay_s: float, call: Callable[[], object]) -> None:
    threading.Timer(delay_s, call).start()


def run_real(script: Script) -> Answer:
    robot = Robot()
    port = serial.Serial(robot.name, BAUD, timeout=3)
    names = {"port": port, "serial": serial, "sleep": time.sleep, "later": later}
    answer = perform(script.text, time.monotonic, names)
    port.close()
    robot.close()
    return answer


def run_all_real() -> dict[str, Answer]:
    """Run all programs on pyserial at once, because they mostly wait, and repeat those that something disturbs."""
    answers: dict[str, Answer] = {}
    left, end_s = SCRIPTS, time.monotonic() + GUARD_S
    while left and (not answers or time.monotonic() < end_s):
        with ThreadPoolExecutor(8 if answers else 24) as pool:
            answers |= zip([each.text for each in left], pool.map(run_real, left), strict=True)
        left = [each for each in left if abs(answers[each.text][1] - each.takes_s) > NOISE_S]
    return answers


PROGRAM = f"""
import pickle, sys, threading, time, serial
from tests.ports.pyserial_scripts import perform
port = serial.Serial("/dev/ttyUSB0", {BAUD}, timeout=3)
later = lambda delay_s, call: threading.Timer(delay_s, call).start()
names = {{"port": port, "serial": serial, "sleep": time.sleep, "later": later}}
with open(sys.argv[1], "wb") as file:
    pickle.dump(perform(sys.argv[2], time.monotonic, names), file)
"""


def run_program(script: Script, path: Path) -> Answer:
    program, said = path / "program.py", path / "said"
    program.write_text(PROGRAM)
    sim = kiks.Simulation(seed=1)
    assert run_here(sim, program, [str(said), script.text], {}) == 0
    answer: Answer = pickle.loads(said.read_bytes())
    return answer


def run_url(script: Script) -> Answer:
    sim = kiks.Simulation(seed=1)
    port: Any = serial.serial_for_url(sim.url(1), baudrate=BAUD, timeout=3)
    names = {"port": port, "serial": serial, "sleep": lambda seconds: port.sim_port.sleep(seconds)}
    return perform(script.text, lambda: sim.time_s, names)


def run_memory(script: Script) -> Answer:
    sim = kiks.Simulation(seed=1)
    port = sim.port(1)
    port.baudrate, port.timeout = BAUD, 3
    return perform(script.text, lambda: sim.time_s, {"port": port, "serial": serial, "sleep": port.sleep})


# ---- the walk ----

PUBLIC = {name for name in dir(serial.Serial) if not name.startswith("_")}
WALKED = {script.text: set(re.findall(r"\bport\.(\w+)", script.text)) for script in SCRIPTS}


def differences(script: Script, kind: str, real: object, answer: Answer) -> list[str]:
    """Return in what a simulated port differs from pyserial; the port in memory has errors of its own."""
    said, took_s = answer
    if kind == "memory" and ERROR.match(str(real)):
        real, said = True, bool(ERROR.match(str(said)))
    lines = [] if said == real else [f"{kind}: {script.text}: said {said}, but pyserial {real}"]
    if abs(took_s - script.takes_s) > CHARACTER_S / 2:
        lines.append(f"{kind}: {script.text}: took {took_s:.3f} s, but pyserial {script.takes_s} s")
    return lines


def test_no_name_of_pyserial_is_forgotten() -> None:
    assert PUBLIC - set().union(*WALKED.values()) == set()
    assert PUBLIC - set(dir(VirtualPort)) == NOT_IN_MEMORY


def compare(script: Script, folder: Path, real: object) -> list[str]:
    """Return in what all simulated ports differ from an answer of pyserial."""
    found = differences(script, "kiks run", real, run_program(script, folder))
    if script.needs in ("", SETTINGS):
        found += differences(script, "kiks://", real, run_url(script))
    if not script.needs and not WALKED[script.text] & NOT_IN_MEMORY and "serial." not in script.text:
        found += differences(script, "memory", real, run_memory(script))
    return found


def test_ports_are_pyserials_to_the_letter(tmp_path: Path) -> None:
    found = []
    for text, (real, real_s) in run_all_real().items():
        script = next(each for each in SCRIPTS if each.text == text)
        if abs(real_s - script.takes_s) > NOISE_S:
            found.append(f"pyserial: {text}: took {real_s:.3f} s, but should take {script.takes_s} s")
        differs = compare(script, tmp_path, real)
        for _ in range(REPEATS):
            # A busy computer may delay a single character of a real run, which shows in no time: it is repeated alone.
            if differs:
                differs = compare(script, tmp_path, run_real(script)[0])
        found += differs
    assert "\n".join(found) == ""


# ---- classes and names of pyserial around a robot ----


@pytest.mark.parametrize(
    ("text", "must"),
    [
        ("port = serial.VTIMESerial('/dev/ttyUSB0', timeout=1)", "b'd\\r\\n' 0.011"),
        ("port = serial.VTIMESerial('/dev/ttyUSB0', timeout=0.19)", "b'd\\r\\n' 0.011"),
        ("port = serial.PosixPollSerial('/dev/ttyUSB0', timeout=1)", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('alt:///dev/ttyUSB0?class=VTIMESerial')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('spy:///dev/ttyUSB0')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('hwgrep://0403:6001')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('socket://127.0.0.1:1')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('rfc2217://127.0.0.1:1')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('kiks://1')", "b'd\\r\\n' 0.011"),
        ("port = serial.serial_for_url('loop://', timeout=1)", "b'D,0' 0.0"),
        ("class Loud(serial.Serial): pass\nport = Loud('COM3')", "b'd\\r\\n' 0.011"),
    ],
)
def test_class_of_pyserial(text: str, must: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "program.py"
    program.write_text(f"""
import serial, time
before = time.monotonic()
{text}
port.write(b"D,0,0\\n")
print(port.read(3), round(time.monotonic() - before, 3))
""")
    before = {name: vars(serial.Serial)[name] for name in vars(serial.Serial)}
    assert run_here(kiks.Simulation(seed=1), program, [], {}) == 0
    said = capsys.readouterr()
    assert said.out == f"{must}\n"
    assert dict(vars(serial.Serial)) == before
    if "spy" in text:  # each line of pyserial's: time, direction, ...
        assert [line.split()[1] for line in said.err.splitlines()] == ["TX", "RX"]


def test_timeout_of_the_driver_begins_anew_with_each_piece(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "program.py"
    program.write_text(f"""
import serial, time
port = serial.VTIMESerial("/dev/ttyUSB0", {BAUD}, timeout=0.45)
port.write(b"H\\n")
print(port.read(20), round(time.monotonic(), 2))
""")
    assert run_here(kiks.Simulation(seed=1), program, [], {}) == 0
    assert capsys.readouterr().out == "b'h,0,0\\r\\n' 1.3\n"


def test_line_comes_whole_to_a_thread_with_a_short_timeout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "reader.py"
    program.write_text("""
import queue, threading, time, serial
port = serial.Serial("/dev/ttyUSB0", 9600, timeout=0.1)
lines, stop = queue.Queue(), threading.Event()
def reader():
    while not stop.is_set():
        line = port.readline()
        if line:
            lines.put(line)
thread = threading.Thread(target=reader)
thread.start()
for command in [b"D,5,5\\n"] + [b"H\\n"] * 8:
    time.sleep(0.085)
    port.write(command)
    print(lines.get(timeout=1).endswith(b"\\r\\n"))
stop.set()
thread.join()
""")
    assert run_here(kiks.Simulation(seed=1), program, [], {}) == 0
    assert capsys.readouterr().out == "True\n" * 9
