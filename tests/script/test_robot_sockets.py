"""Programs that speak to robots by sockets, in simulated time: by Bluetooth, and by TCP at a robot's address."""

import socket
import sys
from pathlib import Path

import pytest
from tests.script.conftest import BOX, Ran, Run, programs_of
from tests.served import PROGRAMS

from kiks import Simulation
from kiks.ports.messages import Answer, Asked, MessageError, Request, Verb, checked_request
from kiks.ports.port_names import PortNames
from kiks.script.runner import run_here

IMPORTS = "import errno, os, select, selectors, socket, threading, time, warnings\n"

TEXT = r"""
=== a read waits up to its timeout, in simulated time
robot = socket.create_connection(("192.168.1.2", 1000), timeout=0.5)
try: robot.recv(1)
except TimeoutError as error: print(error, round(time.monotonic(), 3))
robot.setblocking(False)
try: robot.recv(1)
except BlockingIOError as error: print(error.errno == errno.EAGAIN, round(time.monotonic(), 3))
try: robot.recv(1, socket.MSG_DONTWAIT)
except BlockingIOError as error: print(error.errno == errno.EAGAIN)
robot.settimeout(0.5)
robot.sendall(b"B")
try: robot.recv(1)
except TimeoutError: print(round(time.monotonic(), 3))
> timed out 0.5
> True 0.5
> True
> 1.0
=== replies come whole, and all that have come whole come at once
robot = socket.create_connection(("robot", 1000))
for _ in range(2):
    robot.sendall(b"H\nB\n")
    print(robot.recv(1000), robot.recv(1000))
robot.sendall(b"H\nB\nH\n")
time.sleep(1)
print(robot.recv(3), robot.recv(1000))
> b'h,0,0\r\n' b'b,5.02,5.01\r\n'
> b'h,0,0\r\n' b'b,5.02,5.01\r\n'
> b'h,0' b',0\r\nb,5.02,5.01\r\nh,0,0\r\n'
=== a socket has its other methods, options and files
with socket.socket() as robot:
    robot.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    robot.connect(("192.168.1.2", 1000))
    robot.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    options = (socket.IPPROTO_TCP, socket.TCP_NODELAY), (socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    print([robot.getsockopt(*each) for each in options], robot.getpeername(), robot.family == socket.AF_INET)
    with robot.makefile("rw", newline="\n") as lines:
        for _ in range(2):
            lines.write("H\n")
            lines.flush()
            print(repr(lines.readline()))
    buffer = bytearray(4)
    print(robot.send(b"H\n"), robot.recv_into(buffer), buffer, robot.recvfrom(9))
    print(robot.sendmsg([b"H", b"\n"]), robot.recv(7, socket.MSG_WAITALL))
    robot.sendall(memoryview(b"H\n"))
    print(robot.recv(2, socket.MSG_PEEK), robot.recv(9), robot.recv(0))
    os.write(robot.fileno(), b"H\n")
    print(os.read(robot.fileno(), 9))
    place = "192.168.1.2", 1000
    for method, wrong in (robot.send, "H"), (robot.recv, "1"), (robot.recv, -1), (robot.connect, place):
        try: method(wrong)
        except Exception as error: print(type(error).__name__, error)
try: robot.recv(1)
except OSError as error: print(error)
> [1, 1] ('192.168.1.2', 1000) True
> 'h,0,0\r\n'
> 'h,0,0\r\n'
> 2 4 bytearray(b'h,0,') (b'0\r\n', None)
> 2 b'h,0,0\r\n'
> b'h,' b'h,0,0\r\n' b''
> b'h,0,0\r\n'
> TypeError a bytes-like object is required, not 'str'
> TypeError 'str' object cannot be interpreted as an integer
> ValueError negative buffersize in recv
> OSError [Errno 106] Transport endpoint is already connected
> [Errno 9] Bad file descriptor
=== a connection without a wait is there when the socket can be written
robot = socket.socket()
robot.setblocking(False)
place = "192.168.1.2", 1000
print(robot.connect_ex(place) == errno.EINPROGRESS, select.select([], [robot], [], 5)[1] == [robot])
print(robot.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR))
print(robot.connect_ex(place), robot.connect_ex(place) == errno.EISCONN)
> True True
> 0
> 0 True
=== select, poll and selectors know when a reply is there
robot = socket.create_connection(("192.168.1.2", 1000))
def at(): return round(time.monotonic(), 2)
print(select.select([robot], [robot], [], 3)[:2] == ([], [robot]), select.select([robot], [], [], 0.5)[0], at())
robot.send(b"H\n")
print(select.select([robot], [], [])[0] == [robot], robot.recv(9), at())
poll = select.poll()
poll.register(robot, select.POLLIN)
print(poll.poll(500), at())
robot.send(b"H\nB\n")
with selectors.DefaultSelector() as selector:
    selector.register(robot, selectors.EVENT_READ)
    print(len(selector.select()), robot.recv(99), len(selector.select()), robot.recv(99), selector.select(0.5), at())
> True [] 0.5
> True b'h,0,0\r\n' 0.51
> [] 1.01
> 1 b'h,0,0\r\n' 1 b'b,5.02,5.01\r\n' [] 1.54
=== event loops speak to robots
import asyncio
async def ask(host, count):
    reader, writer = await asyncio.open_connection(host, 1000)
    for _ in range(count):
        writer.write(b"H\n")
        writer.writelines([b"B", b"\n"])
        print(host, await reader.readline(), await reader.readexactly(13))
        await asyncio.sleep(0.1)
    try: await asyncio.wait_for(reader.readline(), 0.5)
    except asyncio.TimeoutError: print(host, round(time.monotonic(), 1))
    writer.close()
    await writer.wait_closed()
async def both(): await asyncio.gather(ask("first.robot", 1), ask("192.168.1.3", 2))
asyncio.run(both())
> 192.168.1.3 b'h,0,0\r\n' b'b,5.02,5.01\r\n'
> first.robot b'h,0,0\r\n' b'b,5.02,5.01\r\n'
> 192.168.1.3 b'h,0,0\r\n' b'b,5.02,5.01\r\n'
> first.robot 0.6
> 192.168.1.3 0.8
=== two robots in threads
def drive(host, speed):
    with socket.create_connection((host, 1000), 1) as robot:
        robot.sendall(b"D,%d,%d\n" % (speed, -speed))
        robot.recv(9)
        time.sleep(0.5)
        robot.sendall(b"E\n")
        print(host, robot.recv(99))
threads = [threading.Thread(target=drive, args=each) for each in (("10.0.0.1", 3), ("10.0.0.2", 5))]
for each in threads: each.start()
for each in threads: each.join()
> 10.0.0.1 b'e,3,-3\r\n'
> 10.0.0.2 b'e,5,-5\r\n'
=== a thread that reads gets the end when another one shuts the socket
robot = socket.create_connection(("192.168.1.2", 1000))
def read():
    print(robot.recv(9), round(time.monotonic(), 1))
    print(select.select([robot], [], [])[0] == [robot], robot.recv(9))
thread = threading.Thread(target=read)
thread.start()
time.sleep(0.5)
robot.shutdown(socket.SHUT_RDWR)
thread.join()
try: robot.send(b"H\n")
except BrokenPipeError as error: print(error)
> b'' 0.5
> True b''
> [Errno 32] Broken pipe
=== a program connects again, closed or not, and no descriptor is left
def ask():
    robot = socket.create_connection(("192.168.1.2", 1000))
    robot.sendall(b"H\nB\n")
    return robot.recv(99), robot
warnings.simplefilter("ignore")
count = len(os.listdir("/proc/self/fd"))
for _ in range(5):
    reply, robot = ask()
    robot.close()
print(reply, ask()[0], len(os.listdir("/proc/self/fd")) - count)
> b'h,0,0\r\n' b'h,0,0\r\n' 0
=== a server of the program itself is at its own port, whatever the number
import contextlib
server = socket.socket()
try: server.bind(("127.0.0.1", 1000))
except PermissionError: server = None
if server is not None:
    server.listen()
    with contextlib.closing(socket.create_connection(("127.0.0.1", 1000))) as here:
        there, _ = server.accept()
        there.sendall(b"hello")
        assert here.recv(9) == b"hello"
print("own")
> own
=== PyBluez finds the robots, and their names and lines
import bluetooth
from bluetooth import *
from bluetooth.btcommon import BluetoothError
print(discover_devices(), round(time.monotonic(), 2))
print(discover_devices(1, lookup_names=True), round(time.monotonic(), 2))
(first, name, kind), _ = bluetooth.discover_devices(0, lookup_names=True, lookup_class=True)
print(lookup_name(first.lower()), lookup_name("00:00:00:00:00:00"), is_valid_address("COM1"))
(service,) = find_service(uuid="1101", address=first)
print(service["host"] == first, service["port"], find_service(uuid="110A"), len(find_service()), RFCOMM)
print(find_service(name=lookup_name(first))[0] == service, find_service(name="COM1"))
try: lookup_name("COM1")
except BluetoothError as error: print(error)
> ['02:4B:49:4B:00:01', '02:4B:49:4B:00:02'] 10.24
> [('02:4B:49:4B:00:01', 'Khepera_0001'), ('02:4B:49:4B:00:02', 'Khepera_0002')] 11.52
> Khepera_0001 None False
> True 1 [] 2 3
> True []
> [Errno 22] COM1 is not a valid Bluetooth address
=== a socket of PyBluez has its errors and sends texts
import bluetooth
robot = bluetooth.BluetoothSocket(bluetooth.RFCOMM)
robot.connect((bluetooth.discover_devices(0)[1], 1))
robot.settimeout(0.5)
robot.send("D,3,3\n")
print(robot.recv(9), robot.getpeername())
try: robot.recv(9)
except bluetooth.btcommon.BluetoothError as error: print(error, type(error).__module__)
try: bluetooth.BluetoothSocket(bluetooth.L2CAP)
except bluetooth.BluetoothError as error: print(error)
robot.close()
try: robot.send(b"E\n")
except bluetooth.BluetoothError as error: print(error)
> b'd\r\n' ('02:4B:49:4B:00:02', 1)
> timed out bluetooth
> [Errno 93] Protocol not supported
> [Errno 9] Bad file descriptor
"""
"""Programs, each below its claim, and behind ">" what they print."""

SOCKETS = programs_of(TEXT)


@pytest.mark.parametrize("claim", SOCKETS)
def test_program_prints(claim: str, run: Run) -> None:
    program, printed = SOCKETS[claim]
    ran = run(IMPORTS + program, robots=2)
    assert (ran.code, ran.out) == (0, printed), ran.err


@pytest.mark.parametrize("thinking", ["none", "fixed:5"])
def test_a_robot_is_the_same_whichever_way_leads_to_it(thinking: str, capfd: pytest.CaptureFixture[str]) -> None:
    def ran(way: str) -> Ran:
        sim = Simulation(BOX, seed=7, thinking=thinking)
        code = run_here(sim, PROGRAMS / "any_way.py", [way, "3"], {})
        return Ran(code, sim.time_s, sim.state_hash(), *capfd.readouterr())

    ways = [ran(way) for way in ("serial", "pybluez", "bluetooth", "tcp")]
    assert ways[0].code == 0
    assert ways.count(ways[0]) == len(ways)


def test_the_speed_of_the_line_is_the_robot_s(run: Run) -> None:
    ran = run("""
        import socket, time
        robot = socket.create_connection(('robot', 1000))
        for rate in (b'9600', b'115200'):
            robot.sendall(b'serial ' + rate + b'\\n')
            robot.recv(99)
            before = time.monotonic_ns()
            robot.sendall(b'B\\n')
            print(len(robot.recv(99)), (time.monotonic_ns() - before) // 10_000)
    """)
    assert ran.out.split() == ["13", "1818", "13", "243"], "15 characters of 11 bits, and a millisecond"


@pytest.mark.parametrize(
    "text",
    [
        "socket.create_connection(('192.168.1.2', 1001))",
        "socket.socket().connect_ex(('192.168.1.2', 80))",
        "socket.socket(type=socket.SOCK_DGRAM).connect(('192.168.1.2', 1000))",
        "socket.getaddrinfo('example.org', 80)",
        "socket.gethostbyname('example.org')",
        "socket.socket(socket.AF_UNIX).connect('/nowhere')",
    ],
)
def test_every_other_connection_is_refused(text: str, run: Run) -> None:
    ran = run(f"import socket\n{text}")
    assert ran.code == 1
    assert ran.err == (
        "kiks: a program in simulated time must talk to its robots alone, but it used the network (program.py, line 2)"
        ". Run it on kiks serve, where time is real.\n"
    )


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "text",
    ["socket.create_connection(('00:01', 1000))", "bluetooth.BluetoothSocket().connect(('00:01', 1))"],
)
def test_one_more_address_than_robots_is_refused_and_the_line_says_what_to_do(text: str, run: Run) -> None:
    ran = run(f"import bluetooth, socket\nrobot = socket.create_connection(('robot1', 1000))\n{text}")
    assert ran.code == 1
    assert ran.err.startswith("kiks: program.py, line 3: [Errno 111] a port must belong to a robot, but '00:01")
    assert "'robot1:1000' is robot 1. Run it with --robots 2, or name its robot: --map 00:01" in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.filterwarnings("ignore")
def test_a_read_to_which_nothing_can_come_ends_with_one_line(run: Run) -> None:
    ran = run("import socket\nrobot = socket.create_connection(('robot', 1000))\nrobot.recv(1)")
    assert ran.code == 1
    assert ran.err.startswith("kiks: program.py, line 3: [Errno 104] robot 1 must have been asked something before")


def test_an_address_leads_to_the_robot_that_map_names(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import bluetooth, socket\n"
        "for place in (('192.168.1.2', 23), ('192.168.1.9', 1000)):\n"
        "    with socket.create_connection(place) as robot:\n"
        "        robot.sendall(b'G,3,3\\n' if place[1] == 23 else b'G,1,1\\n')\n"
        "        print(robot.recv(9), robot.getpeername())\n"
        "robot = bluetooth.BluetoothSocket()\n"
        "robot.connect(('10:00:e8:6c:a2:b6', 1))\n"
        "robot.send(b'G,2,2\\n')\n"
        "print(robot.recv(9), bluetooth.discover_devices(0, lookup_names=True))\n"
        "robot.close()\n"
    )
    sim = Simulation(BOX, robots=3, seed=7)
    code = run_here(sim, program, [], {"192.168.1.2:23": 3, "10:00:E8:6C:A2:B6": 2})
    out, err = capfd.readouterr()
    assert code == 0, err
    assert out.splitlines() == [
        "b'g\\r\\n' ('192.168.1.2', 23)",
        "b'g\\r\\n' ('192.168.1.9', 1000)",
        "b'g\\r\\n' [('10:00:E8:6C:A2:B6', 'Khepera_0002'), ('02:4B:49:4B:00:01', 'Khepera_0001'), "
        "('02:4B:49:4B:00:03', 'Khepera_0003')]",
    ]
    for robot in (1, 2, 3):
        port = sim.port(robot)
        port.write(b"H\n")
        assert port.readline() == b"h,%d,%d\r\n" % (robot, robot)


def test_a_program_finds_its_own_robot_and_free_ones() -> None:
    names = PortNames(Simulation(BOX, robots=4), {}, 2)
    assert [[*names.addresses(program).values()] for program in (1, 2)] == [
        ["Khepera_0001", "Khepera_0003", "Khepera_0004"],
        ["Khepera_0002", "Khepera_0003", "Khepera_0004"],
    ]
    assert [names.robot(address, 2) for address in names.addresses(2)] == [2, 3, 4]
    names.own(4, is_alone=True)
    assert [*names.addresses(4).values()] == ["Khepera_0004"]


def test_a_module_of_the_program_may_be_called_as_the_stand_in(run: Run, tmp_path: Path) -> None:
    (tmp_path / "bluetooth.py").write_text("print('own')\n")
    assert run("import bluetooth").out == "own\n"
    del sys.modules["bluetooth"]


def test_no_more_stands_in_after_the_program(run: Run) -> None:
    before = {*vars(socket)}, socket.socket.connect, {*sys.modules} & {"bluetooth"}
    assert run("import bluetooth, socket\nsocket.AF_BLUETOOTH").code == 0
    assert ({*vars(socket)}, socket.socket.connect, {*sys.modules} & {"bluetooth"}) == before


def test_a_world_that_is_not_trusted_answers_no_read_of_replies_with_nothing() -> None:
    fields = (Verb.READ, 1, 0, 1, 0, (5, b"", None, 0))
    assert checked_request(fields) == Request(*fields)
    asked = Asked()
    asked.note(Request(*fields))
    with pytest.raises(MessageError):
        asked.answer(tuple(Answer(1, 0, (b"", 0))))


@pytest.mark.parametrize("timeout_s", [3, None])
def test_a_read_waits_for_what_a_robot_says_by_itself(
    timeout_s: float | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import bluetooth, time\n"
        "robot = bluetooth.BluetoothSocket()\n"
        "robot.connect(('10:00:E8:6C:A2:B6', 1))\n"
        f"robot.settimeout({timeout_s})\n"
        "robot.send(b'R\\n')\n"
        "print(robot.recv(99), robot.recv(99)[:8], round(time.monotonic(), 1))\n"
        "robot.close()\n"
    )
    code = run_here(Simulation(BOX, robot="epuck"), program, [], {})
    out, err = capfd.readouterr()
    # It starts again, and then says that it is there.
    assert (code, out) == (0, "b'r\\r' b'Selector' 0.4\n"), err
