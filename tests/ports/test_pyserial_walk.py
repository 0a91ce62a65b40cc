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
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import serial
from serial import serialposix
from tests.ports.pyserial_scripts import BAUD, CHARACTER_S, DESCRIPTOR, SCRIPTS, THREADS, Script, perform

import kiks
from kiks.script.runner import run_here
from kiks.sim.port import VirtualPort

NOISE_S = 0.04
"""By how much a real run may differ [s]; one that differs by more was disturbed and is repeated."""

TRIES = 6

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
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        line, received_s, sent_s, sending = b"", 0.0, 0.0, []
        while True:
            wait_s = max(sending[0][0] - time.monotonic(), 0) if sending else None
            try:
                if not select.select([self.end], [], [], wait_s)[0]:
                    os.write(self.end, sending.pop(0)[1])
                    continue
                data = os.read(self.end, BUFFER)
            except OSError:
                return
            for code in data:
                received_s = max(received_s, time.monotonic()) + CHARACTER_S
                line += bytes([code])
                if code == ord("\n"):
                    sent_s = max(sent_s, received_s)
                    for character in REPLIES.get(line[:1], b""):
                        sent_s += CHARACTER_S
                        sending.append((sent_s, bytes([character])))
                    line = b""

    def close(self) -> None:
        os.close(self.kept)
        os.close(self.end)


class Driver:
    """What a pseudo-terminal lacks of a serial driver: a buffer that empties at the line's speed, and control lines."""

    def __init__(self) -> None:
        self._sent_s: dict[int, float] = {}

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
        patch.setattr(serialposix, "os", beside(os, write=driver.write))
        patch.setattr(serialposix, "select", beside(select, select=driver.select))
        patch.setattr(serialposix, "fcntl", beside(serialposix_fcntl, ioctl=driver.ioctl))
        patch.setattr(serialposix, "termios", beside(termios, tcdrain=driver.tcdrain, tcsendbreak=driver.tcsendbreak))
        yield


# ---- the four kinds of ports ----


def later(delay_s: float, call: Callable[[], object]) -> None:
    threading.Timer(delay_s, call).start()


def run_real(script: Script) -> tuple[object, float]:
    """Run a program on pyserial; repeat it while something disturbs it."""
    for _ in range(TRIES):
        robot = Robot()
        port = serial.Serial(robot.name, BAUD, timeout=3)
        names = {"port": port, "serial": serial, "sleep": time.sleep, "later": later}
        said, took_s = perform(script.text, time.monotonic, names)
        port.close()
        robot.close()
        if abs(took_s - script.takes_s) < NOISE_S:
            break
    return said, took_s


PROGRAM = f"""
import pickle, sys, threading, time, serial
from tests.ports.pyserial_scripts import perform
port = serial.Serial("/dev/ttyUSB0", {BAUD}, timeout=3)
later = lambda delay_s, call: threading.Timer(delay_s, call).start()
names = {{"port": port, "serial": serial, "sleep": time.sleep, "later": later}}
with open(sys.argv[1], "wb") as file:
    pickle.dump(perform(sys.argv[2], time.monotonic, names), file)
"""


def run_program(script: Script, path: Path) -> tuple[object, float]:
    """Run a program by `kiks run`."""
    program, said = path / "program.py", path / "said"
    program.write_text(PROGRAM)
    with kiks.Simulation(seed=1) as sim:
        assert run_here(sim, program, [str(said), script.text], {}) == 0
    answer: tuple[object, float] = pickle.loads(said.read_bytes())
    return answer


def run_url(script: Script) -> tuple[object, float]:
    """Run a program on a `kiks://` port."""
    with kiks.Simulation(seed=1) as sim:
        port: Any = serial.serial_for_url(sim.url(1), baudrate=BAUD, timeout=3)
        clock = sim.port(1)
        return perform(script.text, lambda: sim.time_s, {"port": port, "serial": serial, "sleep": clock.sleep})


def run_memory(script: Script) -> tuple[object, float]:
    """Run a program on a port in memory."""
    with kiks.Simulation(seed=1) as sim:
        port = sim.port(1)
        port.baudrate, port.timeout = BAUD, 3
        return perform(script.text, lambda: sim.time_s, {"port": port, "serial": serial, "sleep": port.sleep})


# ---- the walk ----


@pytest.fixture(scope="module")
def real() -> dict[str, tuple[object, float]]:
    """What pyserial says, by program: they run at once, because they mostly wait."""
    with ThreadPoolExecutor(24) as pool:
        return dict(zip([each.text for each in SCRIPTS], pool.map(run_real, SCRIPTS), strict=True))


def names_in(script: Script) -> set[str]:
    return set(re.findall(r"\bport\.(\w+)", script.text))
