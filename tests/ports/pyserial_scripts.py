"""Short programs that walk pyserial's whole interface; `test_pyserial_walk.py` runs each on four kinds of ports.

Each begins with a `port` that has just been opened and ends with `said`, or with an exception. The other end is a robot
that knows `H`, `G` and `B`. A character takes a tenth of a second, and no timeout ends near the arrival of one.
"""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

BAUD = 110
"""Speed of the line: a character of 11 bits takes 0.1 s."""

CHARACTER_S = 0.1

THREADS, DESCRIPTOR, SETTINGS = "threads", "descriptor", "settings"
"""What some programs need of their port besides pyserial's methods."""


class Script(NamedTuple):
    """The source of a program, how long it takes by pyserial's rules [s], and what it needs besides the methods."""

    text: str
    takes_s: float = 0
    needs: str = ""


ASK = "port.write(b'H\\n'); "
"""Asks for the counters: the reply, `h,0,0` and a line end, comes between 0.3 and 0.9 s."""

SLOW = "port.write(b'H\\nG,' + b'0' * 11 + b'1,2\\n'); "
"""Asks, and then sends a command of 17 characters: its reply, `g` and a line end, comes between 2.0 and 2.2 s."""

ROWS: list[Any] = [
    # ---- reads: one timeout for the whole ----
    (ASK + "said = port.read(7)", 0.9),
    (ASK + "said = port.read()", 0.3),
    (ASK + "port.timeout = None; said = port.read(7), port.timeout", 0.9),
    (ASK + "port.timeout = 0.55; said = port.read(7), port.timeout", 0.55),
    (ASK + "port.timeout = 0.55; said = port.read(7), port.read(7)", 1.1),
    (ASK + "sleep(1.05); port.timeout = 0; said = port.read(3), port.read(9), port.read(9)", 1.05),
    (ASK + "said = port.read(0), port.read(-1)",),
    (ASK + "port.timeout = 0.55; said = port.readinto(bytearray(7))", 0.55),
    (ASK + "data = bytearray(5); said = port.readinto(data), data", 0.7),
    (ASK + "import array; data = array.array('B', bytes(5)); said = port.readinto(data), data.tobytes()", 0.7),
    (ASK + "sleep(0.55); said = port.read_all(), port.in_waiting", 0.55),
    (ASK + "port.timeout = 0.55; said = port.readall()", 1.65),
    (ASK + "port.timeout = 1.35; port.inter_byte_timeout = 0.2; said = port.read(20)", 1.35),
    (
        ASK + "import io; port.timeout = 1.05; said = io.BufferedRWPair(port, port).read(7), port.is_open",
        1.05,
        SETTINGS,
    ),
    (
        ASK + "import io; port.timeout = 0.55; said = io.TextIOWrapper(io.BufferedRWPair(port, port, 1)).readline()",
        1.1,
        SETTINGS,
    ),
    # ---- lines: each character has the timeout anew ----
    (ASK + "port.timeout = 0.25; said = port.readline()", 0.25),
    (ASK + "port.timeout = 0.35; said = port.readline()", 0.9),
    (ASK + "port.timeout = 0.35; said = port.readline(), port.readline()", 1.25),
    (ASK + "port.timeout = 0.35; said = port.readline(4), port.readline(0), port.readline(None)", 0.9),
    (ASK + "sleep(0.53); port.timeout = 0.05; said = port.readline(), port.readline()", 0.65),
    (ASK + "sleep(1.05); port.timeout = 0; said = port.readline(), port.readline()", 1.05),
    (SLOW + "port.timeout = 0.35; said = port.readlines()", 1.25),
    (SLOW + "port.timeout = 1.35; said = port.readlines()", 3.55),
    (SLOW + "port.timeout = 1.35; said = port.readlines(3)", 0.9),
    (SLOW + "port.timeout = 1.35; said = [line for line in port]", 3.55),
    (SLOW + "port.timeout = 0.35; said = next(port), iter(port) is port", 0.9),
    ("port.timeout = 0.25; next(port)", 0.25),
    (
        ASK + "read, sizes = port.read, []; port.read = lambda size=1: sizes.append(size) or read(size)\n"
        "said = port.readline(), sizes, port.write(b'H\\n'), port.read_until(b','), sizes",
        1.3,
        SETTINGS,
    ),
    # ---- terminators: pyserial looks at one timeout after each character ----
    (ASK + "port.timeout = 0.55; said = port.read_until(b'\\r')", 0.6),
    (ASK + "port.timeout = 0.85; said = port.read_until(b'\\r')", 0.8),
    (ASK + "port.timeout = 0.25; said = port.read_until()", 0.25),
    (ASK + "port.timeout = 0.95; said = port.read_until(b'x')", 1.85),
    (ASK + "port.timeout = 2; said = port.read_until(b',0'), port.read_until(b'x', 2), port.read_until(size=0)", 0.8),
    (ASK + "sleep(0.65); port.timeout = 0.45; said = port.read_until(b'x')", 1.35),
    (ASK + "sleep(1.05); port.timeout = 0; said = port.read_until(), port.read_until()", 1.05),
    (SLOW + "port.timeout = 1.35; said = list(port.iread_until())", 3.55),
    # ---- what has arrived ----
    (ASK + "sleep(0.55); said = port.in_waiting", 0.55),
    (ASK + "said = 0\nwhile said < 7:\n    sleep(0.02)\n    while port.in_waiting: said += len(port.read())", 0.9),
    (ASK + "sleep(0.55); port.reset_input_buffer(); said = port.in_waiting, port.read(4)", 0.9),
    (ASK + "sleep(0.55); port.flushInput(); said = port.inWaiting(), port.read(4)", 0.9),
    (ASK + "sleep(1.05); port.close(); port.open(); port.timeout = 0; said = port.read(7)", 1.05),
    # ---- writes ----
    ("said = port.write(b'H\\n'), port.write(bytearray(b'H\\n')), port.write(memoryview(b'H\\n')), port.write([72])",),
    ("said = port.writelines([b'H', b'\\n']), port.read(7)", 0.9),
    ("said = port.write(b''), port.out_waiting",),
    ("port.write(b'H\\n' * 5); said = port.out_waiting; sleep(0.25); said = said, port.out_waiting", 0.25),
    ("port.write(b'H\\n' * 5); port.flush(); said = port.out_waiting, port.in_waiting", 1.0),
    # (pyserial waits until the driver would take one more.)
    ("port.write(b'\\n' * 4093); said = port.write(b'\\n' * 5), port.out_waiting", 0.3),
    ("port.write(b'\\n' * 4090); port.write_timeout = 0.35; said = port.write(b'\\n' * 8), port.out_waiting", 0.3),
    ("port.write(b'\\n' * 4090); port.write_timeout = 0.35; port.write(b'\\n' * 20)", 0.35),
    ("port.write_timeout = 0; said = port.write(b'\\n' * 5000), port.write(b'\\n' * 5), port.write_timeout", 0.1),
    ("port.writeTimeout = 0.35; said = port.writeTimeout, port.write_timeout",),
    # ---- calling off ----
    (ASK + "port.cancel_read(); said = port.read(7), port.read(7)", 0.9),
    (ASK + "sleep(1.05); port.cancel_read(); port.cancel_read(); said = port.readline(), port.readline()", 1.05),
    (ASK + "port.cancel_read(); said = port.read(0), port.read_until(), port.read_until()", 0.9),
    (ASK + "later(0.55, port.cancel_read); said = port.read(7), port.read(4)", 0.9, THREADS),
    (ASK + "port.timeout = 0.75; later(0.55, port.cancel_read); said = port.readline(), port.readline()", 0.9, THREADS),
    ("later(0.55, port.cancel_read); port.timeout = None; said = port.read(7)", 0.55, THREADS),
    ("port.cancel_write(); said = port.write(b'H\\n'), port.write(b'H\\n'), port.read(14)", 1.6),
    ("later(0.25, port.cancel_write); said = port.write(b'\\n' * 5000) // 100", 0.25, THREADS),
    # ---- settings ----
    ("said = port.get_settings(); port.apply_settings({'timeout': 0.25}); said = said, port.getSettingsDict()",),
    ("port.applySettingsDict({'timeout': 0.25}); said = port.read(), port.timeout", 0.25),
    ("said = port.BAUDRATES, port.BAUDRATE_CONSTANTS, port.BYTESIZES, port.PARITIES, port.STOPBITS",),
    ("port.bytesize, port.parity, port.stopbits = 7, 'E', 2; said = port.bytesize, port.parity, port.stopbits",),
    ("port.xonxoff = port.rtscts = port.dsrdtr = True; said = port.xonxoff, port.rtscts, port.dsrdtr",),
    ("port.inter_byte_timeout = 0.1; said = port.interCharTimeout",),
    ("port.baudrate = '300'; said = port.baudrate; port.baudrate = 9600.5; said = said, port.baudrate", 0, SETTINGS),
    ("import serial.rs485; port.rs485_mode = serial.rs485.RS485Settings()",),
    ("port.rs485_mode = None; said = port.rs485_mode",),
    ("port.exclusive = True; said = port.exclusive; port.exclusive = False; said = said, port.exclusive",),
    ("port.exclusive = True; type(port)(port.port, exclusive=True)", 0, DESCRIPTOR),
    ("port.exclusive = True; port.close(); said = type(port)(port.port, exclusive=True).is_open", 0, DESCRIPTOR),
    ("other = type(port)(port.port); other.exclusive = True; port.exclusive = True", 0, DESCRIPTOR),
    # ---- lines besides the two for characters ----
    ("said = port.cts, port.dsr, port.ri, port.cd",),
    ("said = port.getCTS(), port.getDSR(), port.getRI(), port.getCD()",),
    ("port.rts = port.dtr = False; said = port.rts, port.dtr\nport.setRTS(); port.setDTR(); said = said, port.rts",),
    ("port.close(); port.dtr = port.rts = False; port.open(); said = port.dtr, port.rts; port.send_break(0.1)", 0.25),
    ("port.break_condition = True; said = port.break_condition; port.break_condition = False",),
    ("said = port.send_break()", 0.1),
    ("said = port.sendBreak(0.1)", 0.25),
    ("said = port.set_low_latency_mode(True), port.set_input_flow_control(False), port.set_input_flow_control()",),
    (
        "port.set_output_flow_control(False); port.set_output_flow_control(); port.write(b'H\\n'); said = port.read(7)",
        0.9,
    ),
    # ---- the object ----
    ("said = port.name == port.port == port.portstr, port.is_open, port.isOpen(), port.closed",),
    ("said = port.readable(), port.writable(), port.seekable(), port.isatty()",),
    ("said = repr(port).replace(port.port, 'PORT').replace(f'{id(port):x}', 'ID')",),
    ("port.setPort(port.port); said = port.is_open, port.write(b'H\\n'), port.read(7)", 0.9),
    ("with port as same: same.write(b'H\\n'); said = same.read(7)\nsaid = said, port.is_open, port.closed", 0.9),
    ("port.close()\nwith port: said = port.is_open\nport.close(); said = said, port.is_open, port.closed",),
    ("import warnings; warnings.simplefilter('error'); port.nonblocking()",),
    ("said = port.fileno() == port.fd, port.fd > 2, isinstance(port, serial.Serial)", 0, DESCRIPTOR),
]
SCRIPTS = [Script(*row) for row in ROWS]


def listed(text: str) -> list[str]:
    """Return what is separated by two blanks at least, or by the end of a line."""
    return re.split(r"\s{2,}", text.strip())


WRONG = listed("""
    port.read(None)  port.read('3')  port.readline(2.5)  port.read_until(None)  port.write('H\\n')
    port.write(None)  port.write([300])  port.inter_byte_timeout = 26  port.timeout = -1  port.timeout = 'x'
    port.write_timeout = -1  port.bytesize = 9  port.parity = 'X'  port.stopbits = 3  port.baudrate = -1
    port.baudrate = None  port.baudrate = 'x'  port.port = 3  port.open()  port.seek(0)  port.tell()
    port.truncate()  serial.Serial().open()  serial.Serial(baudrate='x')  serial.Serial(colour=1)
""")
"""What ends with an exception, although the port is open."""

CLOSED = listed("""
    close()  read()  read(None)  readline()  readlines()  read_until()  read_all()  readinto(bytearray(3))
    write(b'H')  write('H')  flush()  in_waiting  out_waiting  reset_input_buffer()  reset_output_buffer()
    flushOutput()  cancel_read()  cancel_write()  send_break()  cts  dsr  ri  cd  set_low_latency_mode(True)
    set_input_flow_control()  set_output_flow_control()  fileno()  fd  __setattr__('timeout', 1)
    __setattr__('baudrate', 300)  __setattr__('rts', False)  __next__()  __iter__() is port  isatty()
""")
"""What is asked of a port that is closed, and of one that has never been open."""

SCRIPTS += map(Script, WRONG)
SCRIPTS += [
    Script(
        f"port.close(); {port}said = port.{what}", 0, SETTINGS if what in ("fd", "__setattr__('baudrate', 300)") else ""
    )
    for port in ("", "port = serial.Serial(); ")
    for what in CLOSED
]


def perform(script: str, now_s: Callable[[], float], names: dict[str, Any]) -> tuple[object, float]:
    """Return what a program has said, or the class and the message of its exception, and how long it took [s]."""
    begin_s = now_s()
    try:
        exec(script, names)
        said = names.get("said")
    except Exception as error:
        said = f"{type(error).__name__}: {error}".replace(getattr(names["port"], "port", None) or "PORT", "PORT")
    return said, now_s() - begin_s
