"""What programs print in simulated time: what they print without KiKS, where times are simulated."""

import pytest
from tests.script.conftest import Run, programs_of

IMPORTS = "import os, select, serial, signal, socket, threading, time\n"

TEXT = r"""
=== waiting for what is left of a time comes to an end
for _ in range(3): time.sleep(2e-16)
print(time.monotonic_ns())
> 3
=== locks of the library are there for modules that are imported later
import functools
class A:
    @functools.cached_property
    def b(self): return 3
print(A().b)
> 3
=== a method of a class whose functions change is pickled
import datetime, pickle
time.sleep(True)
print(time.monotonic(), pickle.loads(pickle.dumps(datetime.datetime.now)).__name__)
> 1.0 now
=== a thread that has ended does not count
before = threading.active_count()
thread = threading.Thread(target=print)
thread.start()
thread.join()
print(threading.active_count() == before)
>
> True
=== threads that are started take no time
threads = [threading.Thread(target=time.sleep, args=(1,)) for _ in range(300)]
for each in threads: each.start()
for each in threads: each.join()
print(time.monotonic())
> 1.0
=== the main thread waits for all threads except daemons
import atexit
atexit.register(lambda: print('last', time.monotonic()))
def tick():
    while True:
        time.sleep(1)
threading.Thread(target=tick, daemon=True).start()
threading.Timer(2.5, print, ['timer']).start()
print('main')
> main
> timer
> last 2.5
=== a thread holds a lock as often after a wait at its condition as before
import threading
changed = threading.Condition()
def change():
    with changed:
        print('changed')
        changed.notify()
with changed, changed, changed:
    threading.Thread(target=change).start()
    changed.wait()
    print('woken')
print('free', changed.acquire(False))
> changed
> woken
> free True
=== locals, identities and names are those of each thread
own = threading.local()
def work(number):
    own.number = number
    time.sleep(1)
    thread = threading.current_thread()
    print(own.number, thread.name, threading.get_ident() == thread.ident, time.monotonic())
for number in range(2):
    threading.Thread(target=work, args=(number,), name=f't{number}').start()
print(threading.current_thread() is threading.main_thread(), hasattr(own, 'number'))
> True False
> 0 t0 True 1.0
> 1 t1 True 1.0
=== each thread has its own loop of events
import asyncio
async def work():
    me = asyncio.current_task()
    for _ in range(3):
        await asyncio.sleep(0.1)
        time.sleep(0.05)
        assert asyncio.current_task() is me
async def main():
    threads = [threading.Thread(target=lambda: asyncio.run(work())) for _ in range(2)]
    for thread in threads: thread.start()
    me = asyncio.current_task()
    time.sleep(0.02)
    assert asyncio.current_task() is me
    await asyncio.sleep(1)
    print([thread.is_alive() for thread in threads])
asyncio.run(main())
print(time.monotonic_ns())
> [False, False]
> 1020000000
=== every clock tells the robot's time
import datetime, sched, timeit
clocks = [time.time, time.monotonic, time.perf_counter, time.process_time, time.thread_time, timeit.default_timer,
          lambda: time.clock_gettime(time.CLOCK_MONOTONIC), lambda: time.time_ns() / 1e9,
          lambda: datetime.datetime.now().timestamp(), lambda: datetime.datetime.now(datetime.UTC).timestamp(),
          lambda: time.mktime(time.localtime())]
before = [clock() for clock in clocks]
scheduler = sched.scheduler()
scheduler.enter(7, 1, lambda: None)
scheduler.run()
print({round(clock() - start) for clock, start in zip(clocks, before)})
print(isinstance(datetime.datetime.now(), datetime.datetime), datetime.date.today().year in (1999, 2000))
print(time.strftime('%Y-%m-%d', time.gmtime()))
> {7}
> True True
> 2000-01-01
=== queues wait for room and for what is put in
import queue
items, simple = queue.Queue(maxsize=1), queue.SimpleQueue()
def feed():
    for number in range(3):
        items.put(number)
        time.sleep(1)
threading.Thread(target=feed).start()
print([items.get(timeout=5) for _ in range(3)], time.monotonic())
try: items.get(timeout=2)
except queue.Empty: print("empty", time.monotonic())
threading.Timer(1, simple.put, ["late"]).start()
print(simple.get(), time.monotonic())
> [0, 1, 2] 2.0
> empty 4.0
> late 5.0
=== other programs take no simulated time
import subprocess
sleeper = subprocess.Popen(['sleep', '0.05'])
print(sleeper.poll(), sleeper.wait(timeout=0.001))
> 0 0
=== a signal that is blocked is waited for
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGUSR1])
os.kill(os.getpid(), signal.SIGUSR1)
print(signal.sigpending() == {signal.SIGUSR1} == {signal.sigwait([signal.SIGUSR1])})
signal.pthread_sigmask(signal.SIG_UNBLOCK, [signal.SIGUSR1])
print(signal.set_wakeup_fd(-1))
try: signal.signal(signal.SIGKILL, signal.default_int_handler)
except OSError as error: print(error)
> True
> -1
> [Errno 22] Invalid argument
=== a look at what does not block is a poll
a, b = socket.socketpair()
a.setblocking(False)
r, w = os.pipe()
os.set_blocking(r, False)
threading.Timer(1, b.send, (b'x',)).start()
threading.Timer(2, os.write, (w, b'y')).start()
for look in (lambda: a.recv(9), lambda: os.read(r, 9)):
    while True:
        try: print(look()); break
        except BlockingIOError: pass
before = time.monotonic_ns()
threading.Timer(1, b.send, (b'z',)).start()
print(select.select([a, r], [], [], 0.5), select.select([a, r], [], [])[0] == [a], time.monotonic_ns() - before)
a.close(); b.close()
> b'x'
> b'y'
> ([], [], []) True 1000000000
=== a thread plays the robot on a pseudo-terminal, also for a class of one's own
import tty
class Mine(serial.Serial):
    def write(self, data): return super().write(data + b'\n')
master, slave = os.openpty()
tty.setraw(slave)
def play():
    while True:
        data = os.read(master, 100)
        time.sleep(0.25)
        os.write(master, b'fake ' + data)
threading.Thread(target=play, daemon=True).start()
with Mine(os.ttyname(slave), timeout=1) as fake, Mine('/dev/ttyUSB0', timeout=1) as robot:
    for port in fake, robot, fake:
        port.write(b'B')
        print(port.readline())
    fake.timeout, began = 0.5, time.monotonic()
    print(fake.read(), round(time.monotonic() - began, 1), isinstance(fake, Mine))
> b'fake B\n'
> b'b,5.02,5.01\r\n'
> b'fake B\n'
> b'' 0.5 True
=== much goes through a pipe and a socket
r, w = os.pipe()
a, b = socket.socketpair()
data = bytes(1 << 20)
def write():
    with os.fdopen(w, 'wb') as file: file.write(data)
    a.send(data); a.close()
threading.Thread(target=write).start()
with os.fdopen(r, 'rb') as file: print(len(file.read()))
print(sum(len(each) for each in iter(lambda: b.recv(1 << 16), b'')))
b.close()
> 1048576
> 1048576
=== a socket of the program is known by its address, even unbound or closed
server = socket.create_server(('127.0.0.1', 0))
with socket.create_connection(server.getsockname()) as client: client.sendall(b'hello')
peer = server.accept()[0]
print(peer.recv(9))
a, b = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
a.bind(('127.0.0.1', 0))
threading.Timer(1, b.sendto, (b'q', a.getsockname())).start()
data, sender = a.recvfrom(9)
a.sendto(data.upper(), sender)
print(b.recv(9), time.monotonic())
for each in (server, peer, a, b): each.close()
> b'hello'
> b'Q' 1.0
=== what epoll tells only once is told
r, w = os.pipe()
poll = select.epoll()
poll.register(r, select.EPOLLIN | select.EPOLLONESHOT)
threading.Timer(1, os.write, (w, b'x')).start()
print(len(poll.poll()), poll.poll(0.5))
> 1 []
=== waits for a port as a file end when a character comes or the time is over
import selectors
port = serial.Serial('/dev/ttyUSB0', 9600, timeout=1)
poll, epoll, selector = select.poll(), select.epoll(), selectors.DefaultSelector()
poll.register(port, select.POLLIN)
epoll.register(port.fileno(), select.EPOLLIN)
selector.register(port, selectors.EVENT_READ)
for wait in (lambda: select.select([port], [], [], 0.5)[0] == [port], lambda: bool(poll.poll(500)),
             lambda: bool(epoll.poll(0.5)), lambda: bool(selector.select(0.5))):
    before = time.monotonic_ns()
    print(wait(), time.monotonic_ns() - before)
    port.write(b'H\n')
    line = b''
    while not line.endswith(b'\n'):
        assert wait()
        line += os.read(port.fileno(), 100)
    print(line, 505_000_000 < time.monotonic_ns() - before < 520_000_000)
> False 500000000
> b'h,0,0\r\n' True
> False 500000000
> b'h,0,0\r\n' True
> False 500000000
> b'h,0,0\r\n' True
> False 500000000
> b'h,0,0\r\n' True
=== every copy of a port's descriptor is the port, and what is written past Python goes to the robot
import ctypes, fcntl, io, subprocess
port = serial.Serial('COM1', timeout=1)
fd, copy = port.fd, os.dup(port.fd)
def ask(write, read):
    write(b'B\n')
    time.sleep(0.1)
    said = read()
    said, left = said if isinstance(said, tuple) else (said, None)
    if said != b'b,5.02,5.01\r\n' or left or port.in_waiting: print(said, left, port.read_all())
def scattered():
    first, second = bytearray(3), bytearray(20)
    count = os.readv(copy, [first, second])
    return bytes(first + second)[:count]
def into(file):
    piece = bytearray(20)
    return bytes(piece[:file.readinto(piece)])
file = io.FileIO(copy, 'r+', closefd=False)
third = fcntl.fcntl(os.dup2(fd, 50), fcntl.F_DUPFD, 60)
ask(lambda data: os.write(copy, data), lambda: os.read(third, 20))
ask(lambda data: os.writev(fd, [data[:1], data[1:]]), scattered)
ask(file.write, lambda: (file.read(20), file.read(20)))
ask(file.write, lambda: (file.read(), file.readall()))
with open(os.ttyname(fd), 'r+b', 0) as other: ask(other.write, lambda: into(file))
with open(f'/proc/self/fd/{fd}', 'rb') as other: ask(file.write, other.readline)
ask(lambda data: ctypes.CDLL(None).write(fd, data, 2), port.readline)
ask(lambda data: subprocess.run(['echo', 'B'], stdout=port), port.readline)
with open('B', 'wb') as source: source.write(b'B\n')
with open('B', 'rb') as source: ask(lambda data: os.sendfile(third, source.fileno(), 0, 2), port.readline)
begin = time.time()
os.write(copy, b'B\n')
print(select.select([third], [], [], 1)[0] == [third], 0 < time.time() - begin < 0.01)
print(os.read(copy, 20)[:1])
os.set_blocking(copy, True)
print(os.read(copy, 1), port.readline())
> True True
> b'b'
> b',' b'5.02,5.01\r\n'
=== a terminal's speed is that of the line
import termios
port = serial.Serial('COM1', 9600, timeout=1)
def ask():
    begin = time.time()
    port.write(b'B\n')
    port.readline()
    return termios.tcgetattr(port.fd)[4:6] == [termios.B9600] * 2, 0.01 < time.time() - begin
print(ask())
attributes = termios.tcgetattr(port.fd)
attributes[4:6] = [termios.B38400] * 2
termios.tcsetattr(port.fd, termios.TCSAFLUSH, attributes)
print(ask())
port.timeout = 2
print(ask())
> (True, True)
> (False, False)
> (True, True)
=== a port may be opened twice unless exclusively
first = serial.Serial('COM1', timeout=1)
second = serial.Serial('COM1', timeout=1)
first.write(b'H\n')
print(second.readline())
second.close()
first.write(b'G,3,4\nH\n')
print(first.readline(), first.readline())
third = serial.Serial('COM1', exclusive=True)
try:
    serial.Serial('COM1', exclusive=True)
except serial.SerialException as error:
    print('exclusive' in str(error))
> b'h,0,0\r\n'
> b'g\r\n' b'h,3,4\r\n'
> True
=== a read is called off by another thread
port = serial.Serial('COM1')
threading.Timer(3, port.cancel_read).start()
print(port.read(5), time.monotonic())
threading.Timer(3, port.close).start()
try:
    port.read(5)
except TypeError as error:
    print(error, time.monotonic())
> b'' 3.0
> 'NoneType' object cannot be interpreted as an integer 6.0
=== ports are listed and are in their folder
import glob, stat
from pathlib import Path
from serial.tools import list_ports
def named(paths): return sorted(str(path) for path in paths if "ttyUSB" in str(path))
print([info.device for info in list_ports.comports()], [info.vid for info in list_ports.grep('USB')])
print(glob.glob("/dev/ttyUSB*"), named(Path("/dev").glob("ttyUSB*")), named(os.listdir("/dev")))
print(glob.glob("/dev/ttyUSB0"), list(glob.iglob("/dev/ttyUSB0")), os.access("/dev/ttyUSB0", os.R_OK | os.W_OK))
print(stat.S_ISCHR(os.stat("/dev/ttyUSB0").st_mode), Path("/dev/ttyUSB0").is_char_device())
print([os.path.exists(f"/dev/ttyUSB{number}") for number in (1, 2, 77)], Path("/dev/ttyUSB77").exists())
print([(entry.path, entry.is_file()) for entry in os.scandir("/dev") if "ttyUSB" in entry.name])
for number in range(5):
    try: print(serial.Serial(f'COM{number}').name)
    except serial.SerialException: pass
> ['/dev/ttyUSB0', '/dev/ttyUSB1'] [1027, 1027]
> ['/dev/ttyUSB0', '/dev/ttyUSB1'] ['/dev/ttyUSB0', '/dev/ttyUSB1'] ['ttyUSB0', 'ttyUSB1']
> ['/dev/ttyUSB0'] ['/dev/ttyUSB0'] True
> True True
> [True, False, False] False
> [('/dev/ttyUSB0', False), ('/dev/ttyUSB1', False)]
> COM0
> COM1
=== files are as old as the clock says
import shutil
from pathlib import Path
def age(name): return round(time.time() - os.path.getmtime(name), 3)
print(time.time() >= os.path.getmtime("program.py"))
file = open("log", "w")
time.sleep(2)
print(age("log"))
file.write("line")
file.flush()
print(age("log"))
time.sleep(1)
file.close()
print(age("log"), round(time.time() - Path("log").stat().st_mtime, 3), [round(time.time() - entry.stat().st_mtime, 3)
      for entry in os.scandir(".") if entry.name == "log"])
os.utime("log", (5e8, 1e9))
print(os.path.getmtime("log"), os.path.getatime("log"))
shutil.copy2("log", "copy")
print(os.path.getmtime("copy"))
os.utime("log")
print(age("log"))
os.rename("log", "old")
os.mkdir("folder")
time.sleep(1)
print(age("old"), age("folder"))
> True
> 2.0
> 0.0
> 1.0 1.0 [1.0]
> 1000000000.0 500000000.0
> 1000000000.0
> 0.0
> 1.0 1.0
"""
"""Programs, each below its claim, and behind ">" what they print."""

PROGRAMS = programs_of(TEXT)


@pytest.mark.parametrize("claim", PROGRAMS)
def test_program_prints(claim: str, run: Run) -> None:
    program, printed = PROGRAMS[claim]
    ran = run(IMPORTS + program, robots=2)
    assert (ran.code, ran.out) == (0, printed), ran.err
