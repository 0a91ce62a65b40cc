"""Simulated ports against pyserial itself on a plain driver, method by method: bytes, exceptions and times."""

import errno
import fcntl
import os
import pickle
import re
import select
import struct
import termios
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import serial
from serial import serialposix, serialutil
from tests.ports.pyserial_scripts import BAUD, CHARACTER_S, SCRIPTS, SETTINGS, Script, perform

import kiks
from kiks.model.robot import RobotSpec
from kiks.script.runner import run_here
from kiks.sim.port import VirtualPort
from kiks.units import NS_PER_S

CHARACTER_NS = round(CHARACTER_S * NS_PER_S)

ERROR = re.compile(r"[A-Z]\w+: ")
"""What a program says that ends with an exception."""

NAMES = """
    BAUDRATES BAUDRATE_CONSTANTS BYTESIZES PARITIES STOPBITS
    applySettingsDict apply_settings getSettingsDict get_settings bytesize parity stopbits xonxoff rtscts dsrdtr
    exclusive interCharTimeout inter_byte_timeout rs485_mode writeTimeout port setPort open
    break_condition cd cts dsr dtr getCD getCTS getDSR getRI ri rts sendBreak send_break setDTR setRTS
    set_input_flow_control set_low_latency_mode set_output_flow_control
    fileno isatty nonblocking flushInput flushOutput inWaiting isOpen
    closed readable seek seekable tell truncate writable
"""
NOT_IN_MEMORY = set(NAMES.split())
"""What the port in memory does not have: settings that change nothing, old names, and what concerns files."""

Answer = tuple[object, float]
"""What a program has said, and how long it took [s]."""

THINKING_NS = 1_000_000
"""From a command to its reply."""

BUFFER = 4096
"""Characters in the buffer of a serial driver."""

REPLIES = {b"H": b"h,0,0\r\n", b"G": b"g\r\n"}


class Driver:
    """A serial driver with a robot at the other end of its line, in a time that passes only while a program waits.

    A pseudo-terminal stands for the device: it is opened, locked and asked for its settings.
    """

    def __init__(self) -> None:
        self._ends = os.openpty()
        self.name = os.ttyname(self._ends[1])
        self._now_ns = self._sent_ns = self._replied_ns = 0
        self._command = b""
        self._arriving: list[tuple[int, int]] = []
        self._timers: list[tuple[int, Callable[[], object]]] = []

    def close(self) -> None:
        for descriptor in self._ends:
            os.close(descriptor)

    # ---- time ----

    def now_s(self) -> float:
        return self._now_ns / NS_PER_S

    def later(self, delay_s: float, call: Callable[[], object]) -> None:
        self._timers.append((self._now_ns + round(delay_s * NS_PER_S), call))

    def sleep(self, seconds: float) -> None:
        self._pass_to(self._now_ns + round(seconds * NS_PER_S))

    def _pass_to(self, end_ns: int) -> None:
        self._now_ns = max(self._now_ns, end_ns)
        due = [timer for timer in self._timers if timer[0] <= self._now_ns]
        self._timers = [timer for timer in self._timers if timer not in due]
        for _, call in due:
            call()

    def _pass_to_next(self, end_ns: int | None) -> None:
        """Let time pass to the next event, at most to an end."""
        times_ns = [time_ns for time_ns, _ in (*self._arriving, *self._timers) if time_ns > self._now_ns]
        if self._waiting():
            times_ns.append(self._sent_ns - (self._waiting() - 1) * CHARACTER_NS)
        self._pass_to(min(times_ns if end_ns is None else [*times_ns, end_ns]))

    # ---- what replaces functions of modules ----

    def _waiting(self) -> int:
        return max(-((self._now_ns - self._sent_ns) // CHARACTER_NS), 0)

    def _arrived(self) -> int:
        return sum(time_ns <= self._now_ns for time_ns, _ in self._arriving)

    def read(self, descriptor: int, size: int) -> bytes:
        if not os.isatty(descriptor):
            return os.read(descriptor, size)
        count = min(size, self._arrived())
        read, self._arriving = self._arriving[:count], self._arriving[count:]
        return bytes(code for _, code in read)

    def write(self, descriptor: int, data: bytes) -> int:
        if not os.isatty(descriptor):
            return os.write(descriptor, data)
        room = min(BUFFER - self._waiting(), len(data))
        if not room:
            self._pass_to_next(None)
            raise BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable")
        self._sent_ns = max(self._sent_ns, self._now_ns)
        for code in data[:room]:
            self._sent_ns += CHARACTER_NS
            self._command += bytes([code])
            if code == ord("\n"):
                self._replied_ns = max(self._replied_ns, self._sent_ns + THINKING_NS)
                for character in REPLIES.get(self._command[:1], b""):
                    self._replied_ns += CHARACTER_NS
                    self._arriving.append((self._replied_ns, character))
                self._command = b""
        return room

    def select(self, reading: list[int], writing: list[int], _: list[int], wait_s: float | None) -> Any:
        end_ns = None if wait_s is None else self._now_ns + round(wait_s * NS_PER_S)
        while True:
            pipes = [each for each in reading if not os.isatty(each)]
            ready = select.select(pipes, [], [], 0)[0]
            ready += [each for each in reading if each not in pipes and self._arrived()]
            has_room = writing if self._waiting() < BUFFER else []
            if ready or has_room or self._now_ns == end_ns:
                return ready, has_room, []
            self._pass_to_next(end_ns)

    def ioctl(self, descriptor: Any, request: int, argument: Any = 0) -> Any:
        os.fstat(descriptor) if isinstance(descriptor, int) else fcntl.ioctl(descriptor, request, argument)
        if request in (serialposix.TIOCINQ, serialposix.TIOCOUTQ):
            return struct.pack("I", self._arrived() if request == serialposix.TIOCINQ else self._waiting())
        if request == serialposix.TIOCMGET:
            return struct.pack("I", serialposix.TIOCM_CTS | serialposix.TIOCM_DSR | serialposix.TIOCM_CD)
        return fcntl.ioctl(descriptor, request, argument) if request == serialposix.TIOCGRS485 else argument

    def tcsetattr(self, descriptor: int, when: int, attributes: list[Any]) -> None:
        with suppress(termios.error):  # a pseudo-terminal has eight bits and no parity
            termios.tcsetattr(descriptor, when, attributes)

    def tcflush(self, descriptor: int, queue: int) -> None:
        termios.tcflush(descriptor, queue)
        if queue == termios.TCIFLUSH:
            del self._arriving[: self._arrived()]

    def tcdrain(self, descriptor: int) -> None:
        self._pass_to(self._sent_ns)

    def tcsendbreak(self, descriptor: int, duration: int) -> None:
        # glibc and Linux: a quarter of a second, or that many milliseconds, rounded up to tenths of a second.
        self.sleep(-(-duration // 100) * 0.1 if duration else 0.25)


def beside(module: Any, driver: Driver, *names: str) -> SimpleNamespace:
    """Return a module with functions of a driver in place of its own."""
    return SimpleNamespace(**{**vars(module), **{name: getattr(driver, name) for name in names}})


# ---- the four kinds of ports ----


def run_real(script: Script) -> Answer:
    """Run a program on pyserial itself."""
    driver = Driver()
    with closing(driver), pytest.MonkeyPatch.context() as patch:
        patch.setattr(serialutil.Timeout, "TIME", staticmethod(driver.now_s))
        for name, module, functions in (
            ("os", os, ("read", "write")),
            ("select", select, ("select",)),
            ("fcntl", fcntl, ("ioctl",)),
            ("termios", termios, ("tcsetattr", "tcflush", "tcdrain", "tcsendbreak")),
        ):
            patch.setattr(serialposix, name, beside(module, driver, *functions))
        with serial.Serial(driver.name, BAUD, timeout=3) as port:
            names = {"port": port, "serial": serial, "sleep": driver.sleep, "later": driver.later}
            return perform(script.text, driver.now_s, names)


PROGRAM = f"""
import pickle, sys, threading, time, serial
from tests.ports.pyserial_scripts import perform
port = serial.Serial("/dev/ttyUSB0", {BAUD}, timeout=3)
later = lambda delay_s, call: threading.Timer(delay_s, call).start()
names = {{"port": port, "serial": serial, "sleep": time.sleep, "later": later}}
with open(sys.argv[1], "wb") as file:
    pickle.dump(perform(sys.argv[2], time.monotonic, names), file)
"""


@cache
def spec() -> RobotSpec:
    return RobotSpec.load("khepera")


def world() -> kiks.Simulation:
    return kiks.Simulation(seed=1, robot=spec())


def run_program(script: Script, path: Path) -> Answer:
    program, said = path / "program.py", path / "said"
    program.write_text(PROGRAM)
    assert run_here(world(), program, [str(said), script.text], {}) == 0
    answer: Answer = pickle.loads(said.read_bytes())
    return answer


def run_url(script: Script) -> Answer:
    sim = world()
    port: Any = serial.serial_for_url(sim.url(1), baudrate=BAUD, timeout=3)
    names = {"port": port, "serial": serial, "sleep": lambda seconds: port.sim_port.sleep(seconds)}
    return perform(script.text, lambda: sim.time_s, names)


def run_memory(script: Script) -> Answer:
    sim = world()
    port = sim.port(1)
    port.baudrate, port.timeout = BAUD, 3
    return perform(script.text, lambda: sim.time_s, {"port": port, "serial": serial, "sleep": port.sleep})


# ---- the walk ----

PUBLIC = {name for name in dir(serial.Serial) if not name.startswith("_")}
WALKED = {script.text: set(re.findall(r"\bport\.(\w+)", script.text)) for script in SCRIPTS}


def test_no_name_of_pyserial_is_forgotten() -> None:
    assert PUBLIC - set().union(*WALKED.values()) == set()
    assert PUBLIC - set(dir(VirtualPort)) == NOT_IN_MEMORY


def answers(script: Script, folder: Path) -> Iterator[tuple[str, Answer]]:
    """Yield what a program says on pyserial, and then on each kind of simulated ports."""
    yield "pyserial", run_real(script)
    yield "kiks run", run_program(script, folder)
    if script.needs in ("", SETTINGS):
        yield "kiks://", run_url(script)
    if not script.needs and not WALKED[script.text] & NOT_IN_MEMORY and "serial." not in script.text:
        yield "memory", run_memory(script)


def test_ports_are_pyserials_to_the_letter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # From Python 3.13 on, a buffer says so when it is let go after its port was closed: pyserial's and ours.
    monkeypatch.setattr("sys.unraisablehook", lambda _: None)
    found = []
    for script in SCRIPTS:
        real: object = None
        for kind, (said, took_s) in answers(script, tmp_path):
            real = said if kind == "pyserial" else real
            # The port in memory has errors of its own.
            if said != real and not (kind == "memory" and ERROR.match(str(real)) and ERROR.match(str(said))):
                found.append(f"{kind}: {script.text}: said {said}, but pyserial {real}")
            if abs(took_s - script.takes_s) > CHARACTER_S / 2:
                found.append(f"{kind}: {script.text}: took {took_s:.3f} s, but should take {script.takes_s} s")
    assert "\n".join(found) == ""


# ---- classes and names of pyserial around a robot ----

Said = Callable[[str], Any]


@pytest.fixture
def said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Said:
    """Return what runs the text of a program, and returns what it has said."""

    def said(text: str) -> Any:
        (tmp_path / "program.py").write_text(f"import queue, serial, threading, time\n{text}")
        assert run_here(kiks.Simulation(seed=1), tmp_path / "program.py", [], {}) == 0
        return capsys.readouterr()

    return said


def test_class_of_pyserial(said: Said) -> None:
    for port in (
        "serial.VTIMESerial('/dev/ttyUSB0', timeout=1)",
        "serial.VTIMESerial('/dev/ttyUSB0', timeout=0.19)",
        "serial.PosixPollSerial('/dev/ttyUSB0', timeout=1)",
        "serial.serial_for_url('alt:///dev/ttyUSB0?class=VTIMESerial')",
        "serial.serial_for_url('spy:///dev/ttyUSB0')",
        "serial.serial_for_url('hwgrep://0403:6001')",
        "serial.serial_for_url('socket://127.0.0.1:1')",
        "serial.serial_for_url('rfc2217://127.0.0.1:1')",
        "serial.serial_for_url('kiks://1')",
        "serial.serial_for_url('loop://', timeout=1)",
        "type('Loud', (serial.Serial,), {})('COM3')",
    ):
        before = dict(vars(serial.Serial))
        ran = said(f"""
before = time.monotonic()
port = {port}
port.write(b"D,0,0\\n")
print(port.read(3), round(time.monotonic() - before, 3))
""")
        assert ran.out == ("b'D,0' 0.0\n" if "loop" in port else "b'd\\r\\n' 0.011\n")
        assert dict(vars(serial.Serial)) == before
        if "spy" in port:  # each line of pyserial's: time, direction, ...
            assert [line.split()[1] for line in ran.err.splitlines()] == ["TX", "RX"]


def test_timeout_of_the_driver_begins_anew_with_each_piece(said: Said) -> None:
    ran = said(f"""
port = serial.VTIMESerial("/dev/ttyUSB0", {BAUD}, timeout=0.45)
port.write(b"H\\n")
print(port.read(20), round(time.monotonic(), 2))
""")
    assert ran.out == "b'h,0,0\\r\\n' 1.3\n"


def test_line_comes_whole_to_a_thread_with_a_short_timeout(said: Said) -> None:
    ran = said("""
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
    assert ran.out == "True\n" * 9
