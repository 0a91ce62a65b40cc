"""What programs for robots import most: each package does under `kiks run` what it should, in simulated time.

A package that cannot is told of in one line.
"""

# ruff: noqa: E501 (one line of KiKS is longer)

import re
from importlib.util import find_spec
from pathlib import Path

import pytest
from tests import forked
from tests.at_length import at_length, share
from tests.script.conftest import programs_of

pytestmark = pytest.mark.slow

TEXT = r"""
=== aiohttp
import aiohttp, asyncio, time
from aiohttp import web
async def now(request):
    await asyncio.sleep(1)
    return web.Response(text="ok")
async def main():
    app = web.Application()
    app.router.add_get("/", now)
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    port = site._server.sockets[0].getsockname()[1]
    async with aiohttp.ClientSession() as session, session.get(f"http://127.0.0.1:{port}/") as answer:
        print(await answer.text(), answer.headers["Date"], round(time.monotonic(), 1))
    await runner.cleanup()
asyncio.run(main())
> ok Sat, 01 Jan 2000 00:00:01 GMT 1.0
=== aioserial
import aioserial, asyncio, time
async def main():
    port = aioserial.AioSerial("/dev/ttyUSB0", 9600, timeout=1)
    await port.write_async(b"D,2,2\n")
    print(await port.readline_async(), await port.read_async(1), round(time.monotonic(), 1))
asyncio.run(main())
> b'd\r\n' b'' 1.0
=== asyncio
import asyncio, socket, time
def at(): return round(time.monotonic(), 2)
async def main():
    ours, theirs = socket.socketpair()
    reader, writer = await asyncio.open_connection(sock=ours)
    other, answers = await asyncio.open_connection(sock=theirs)
    async def echo():
        line = await other.readline()
        await asyncio.sleep(0.5)
        answers.write(line.upper())
        await answers.drain()
    task = asyncio.create_task(echo())
    writer.write(b"hello\n")
    print(await reader.readline(), at())
    await task
    writer.close()
    answers.close()
    try:
        async with asyncio.timeout(1):
            await asyncio.Event().wait()
    except TimeoutError:
        print("timeout", at())
    print(await asyncio.to_thread(asyncio.run, asyncio.sleep(1)), at())
    async def serve(reader, writer):
        writer.write(await reader.readline())
        writer.close()
    async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
        writer.write(b"round\n")
        print(await reader.read(), at())
        writer.close()
    process = await asyncio.create_subprocess_exec("echo", "spoken", stdout=asyncio.subprocess.PIPE)
    print(await process.communicate(), process.returncode)
asyncio.run(main())
> b'HELLO\n' 0.5
> timeout 1.5
> None 2.5
> b'round\n' 2.5
> (b'spoken\n', None) 0
=== concurrent.futures
import concurrent.futures as futures, time
def work(left):
    time.sleep(left)
    return left, round(time.monotonic(), 2)
with futures.ThreadPoolExecutor(2) as pool:
    print(list(pool.map(work, [1, 2, 1])))
    jobs = [pool.submit(work, each) for each in (2, 1)]
    print([job.result()[0] for job in futures.as_completed(jobs)])
    try:
        pool.submit(work, 5).result(timeout=1)
    except TimeoutError:
        print("late", round(time.monotonic(), 2))
> [(1, 1.0), (2, 2.0), (1, 2.0)]
> [1, 2]
> late 5.0
=== csv
import csv, datetime, json, os, pickle, tempfile, threading
now = datetime.datetime.now().replace(microsecond=0)
assert pickle.loads(pickle.dumps([now, now.date()])) == [now, now.date()]
assert pickle.loads(pickle.dumps([threading.Lock, type(threading.RLock()), threading.Event])) == [threading.Lock, type(threading.RLock()), threading.Event]
with tempfile.NamedTemporaryFile("w+", suffix=".csv", newline="") as file:
    csv.writer(file).writerow([now, 1])
    file.seek(0)
    print(list(csv.reader(file)))
    print("~", os.path.basename(file.name))
print(json.dumps({"now": now.isoformat()}))
> [['2000-01-01 00:00:00', '1']]
> {"now": "2000-01-01T00:00:00"}
=== fcntl
import fcntl, tempfile
with tempfile.NamedTemporaryFile() as first, open(first.name) as second:
    fcntl.flock(first, fcntl.LOCK_EX)
    fcntl.flock(second, fcntl.LOCK_EX)
> kiks: a program in simulated time must wait by time.sleep, a lock or a port, but it waited by itself (program.py, line 4). Run it on kiks serve, where time is real.
=== logging
import logging, logging.handlers, os, tempfile, time
folder = tempfile.mkdtemp()
log = logging.getLogger("robot")
def start():
    handler = logging.handlers.TimedRotatingFileHandler(os.path.join(folder, "log"), when="S", interval=60, utc=True)
    handler.setFormatter(logging.Formatter("%(asctime)s %(relativeCreated)d %(threadName)s %(message)s"))
    log.addHandler(handler)
    return handler
handler = start()
for number in range(4):
    log.warning(number)
    time.sleep(45)
log.removeHandler(handler)
handler.close()
start()
time.sleep(20)
log.warning("again")
print(sorted(os.listdir(folder)))
with open(os.path.join(folder, "log.2000-01-01_00-00-00")) as file:
    print(file.read(), end="")
> ['log', 'log.2000-01-01_00-00-00', 'log.2000-01-01_00-02-15']
> 2000-01-01 00:00:00,000 0 MainThread 0
> 2000-01-01 00:00:45,000 45000 MainThread 1
=== matplotlib
import matplotlib, io, os, tempfile, time
matplotlib.use("Agg")
import matplotlib.pyplot as plt, matplotlib.dates as dates, datetime
plt.plot([datetime.datetime.now(), datetime.datetime.now() + datetime.timedelta(1)], [1, 2])
plt.pause(0.5)
name = tempfile.mktemp(suffix=".svg")
plt.savefig(name)
text = open(name).read()
print(text.count("2000-01-01"), round(time.monotonic(), 1), round(time.time() - os.path.getmtime(name)))
> 1 0.5 0
=== multiprocessing
import multiprocessing
queue = multiprocessing.Queue()
queue.put(1)
print(queue.get(), multiprocessing.Value("i", 3).value, multiprocessing.Lock().acquire(timeout=1))
multiprocessing.Event().wait(5)
> 1 3 True
> kiks: a program in simulated time must wait by locks of threading, but it waited for one of multiprocessing (program.py, line 5). Use those, or run it on kiks serve, where time is real.
=== numpy
import numpy, time
time.sleep(90061)
print(numpy.datetime64("now"), numpy.datetime64("today"))
print("~", numpy.random.default_rng().random(2), numpy.random.rand(2), numpy.random.RandomState().rand(), numpy.random.SeedSequence().entropy)
> 2000-01-02T01:01:01 2000-01-02
=== pandas
import io, time
import pandas
time.sleep(3600)
now = [pandas.Timestamp.now(), pandas.Timestamp("today"), pandas.to_datetime("now"), pandas.Timestamp.now("Europe/Berlin")]
print([str(each.floor("s")) for each in now])
table = pandas.DataFrame({"day": pandas.date_range(now[0].normalize(), periods=3), "speed": [1, 2, 3]})
again = pandas.read_csv(io.StringIO(table.to_csv(index=False)), parse_dates=["day"])
print(list(again.day) == list(table.day), again.speed.sum(), table.day.iloc[-1].date())
print("~", table.sample(2).speed.to_list())
> ['2000-01-01 01:00:00', '2000-01-01 01:00:00', '2000-01-01 01:00:00', '2000-01-01 02:00:00+01:00']
> True 6 2000-01-03
=== psutil
import os, time
import psutil
me = psutil.Process()
print(me.pid == os.getpid(), psutil.cpu_count() > 0, psutil.virtual_memory().total > 0, me.is_running())
print(psutil.cpu_percent(interval=1) >= 0, round(time.monotonic(), 1))
> True True True True
> True 1.0
=== pydantic
import datetime, pydantic
class Sample(pydantic.BaseModel):
    taken: datetime.datetime = pydantic.Field(default_factory=datetime.datetime.now)
    day: pydantic.PastDate = datetime.date(1999, 12, 31)
class Later(pydantic.BaseModel):
    at: pydantic.FutureDatetime
print(Sample().model_dump_json()[:30], Sample(day="1999-12-31").day)
print(Later(at="2000-01-02T00:00:00").at)
try:
    Sample(day="2005-01-01")
    print("wrong")
except pydantic.ValidationError:
    print("future")
> {"taken":"2000-01-01T00:00:00" 1999-12-31
> 2000-01-02 00:00:00
> future
=== random
import os, random, secrets, tempfile, uuid
generators = random.Random(), random.SystemRandom()
print("~", random.random(), [each.random() for each in generators], secrets.token_hex(4), uuid.uuid4(), os.urandom(3))
print("~", tempfile.mktemp(), {"left", "right", "front", "back"}, uuid.uuid1())
print((uuid.uuid1().time - 0x01B21DD213814000) // 10**7 - 946684800)
> 0
=== requests
import requests, urllib3
print("imported")
requests.get("http://example.com/")
> imported
> kiks: a program in simulated time must talk to its robots alone, but it used the network (program.py, line 3). Run it on kiks serve, where time is real.
=== rich
import io, time
from rich.console import Console
from rich.progress import track
from rich.table import Table
console = Console(file=io.StringIO(), width=40)
table = Table("name")
table.add_row("robot")
console.print(table)
console.log("hello")
print("robot" in console.file.getvalue(), console.file.getvalue().count("[00:00:00]"))
print(sum(1 for _ in track(range(3), console=console) if time.sleep(1) is None), round(time.monotonic()))
with console.status("busy"):
    time.sleep(1)
print(round(time.monotonic()))
> True 1
> 3 3
> 4
=== signal
import signal, time, threading, os
def at(): return round(time.monotonic(), 2)
signal.signal(signal.SIGALRM, lambda *_: print("alarm", at()))
signal.setitimer(signal.ITIMER_REAL, 0.5, 1)
time.sleep(2)
signal.setitimer(signal.ITIMER_REAL, 0)
signal.alarm(1)
signal.pause()
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGALRM, signal.SIGUSR1])
signal.alarm(2)
print(signal.sigwait([signal.SIGALRM]), at())
threading.Timer(1, os.kill, [os.getpid(), signal.SIGUSR1]).start()
print(signal.sigwaitinfo([signal.SIGUSR1]).si_signo, at())
print(signal.sigtimedwait([signal.SIGUSR1], 1.5), at())
> alarm 0.5
> alarm 1.5
> alarm 3.0
> 14 5.0
> 10 6.0
> None 7.5
=== socket
import socket, socketserver, threading, time
def at(): return round(time.monotonic(), 2)
class Echo(socketserver.StreamRequestHandler):
    def handle(self):
        for line in self.rfile:
            time.sleep(1)
            self.wfile.write(line.upper())
server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Echo)
threading.Thread(target=server.serve_forever, daemon=True).start()
with socket.create_connection(server.server_address, timeout=3) as client, client.makefile("rw") as file:
    for word in ("one", "two"):
        print(word, file=file, flush=True)
        print(file.readline().strip(), at())
    try:
        client.settimeout(0.5)
        client.recv(1)
    except TimeoutError:
        print("timeout", at())
> ONE 1.0
> TWO 2.0
> timeout 2.5
=== sqlite3
import sqlite3, time
time.sleep(100)
base = sqlite3.connect(":memory:", check_same_thread=False)
base.execute("create table log (at text default current_timestamp, what text)")
base.execute("insert into log (what) values ('start')")
print(base.execute("select at, date('now'), strftime('%s', 'now') from log").fetchall())
print("~", base.execute("select random(), hex(randomblob(4))").fetchall())
> [('2000-01-01 00:01:40', '2000-01-01', '946684900')]
=== subprocess
import os, subprocess, time
print(subprocess.run(["echo", "hello"], capture_output=True, text=True, timeout=5).stdout.strip(), os.system("true"))
process = subprocess.Popen(["cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
print("line", file=process.stdin, flush=True)
print(process.stdout.readline().strip())
process.terminate()
print(process.wait(), time.monotonic() < 0.1)
> hello 0
> line
> -15 True
=== threading
import ctypes, signal, threading, time
thread = threading.Thread(target=time.sleep, args=(1,))
thread.start()
print(ctypes.CDLL(None).pthread_setname_np(ctypes.c_ulong(thread.ident), b"name") != 0)
signal.signal(signal.SIGUSR1, lambda *_: print("signal"))
signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)
thread.join()
print(round(time.monotonic(), 2), thread.ident >= 1 << 32)
> True
> signal
> 1.0 True
=== trio
import trio, time
def at(): return round(time.monotonic(), 2)
async def main():
    send, receive = trio.open_memory_channel(0)
    async def talk():
        for item in range(3):
            await trio.sleep(0.5)
            await send.send(item)
        await send.aclose()
    async with trio.open_nursery() as nursery:
        nursery.start_soon(talk)
        print([item async for item in receive], at())
    with trio.move_on_after(1):
        await trio.sleep_forever()
    print(at(), await trio.to_thread.run_sync(lambda: time.sleep(2) or 7), at())
    listeners = await trio.open_tcp_listeners(0, host="127.0.0.1")
    async def serve(stream):
        await stream.send_all(await stream.receive_some(10))
    async with trio.open_nursery() as nursery:
        nursery.start_soon(trio.serve_listeners, serve, listeners)
        stream = await trio.open_tcp_stream("127.0.0.1", listeners[0].socket.getsockname()[1])
        await stream.send_all(b"round")
        print(await stream.receive_some(10), at())
        nursery.cancel_scope.cancel()
trio.run(main)
> [0, 1, 2] 1.5
> 2.5 7 4.5
> b'round' 4.5
=== zoneinfo
import zoneinfo, datetime, time
print(datetime.datetime.now(zoneinfo.ZoneInfo("Europe/Berlin")).isoformat(timespec="seconds"), datetime.datetime.now(datetime.timezone.utc).date(), time.strftime("%Y"), time.localtime().tm_year, datetime.date.today())
> 2000-01-01T01:00:00+01:00 2000-01-01 2000 2000 2000-01-01
"""
"""A program for each package, and behind ">" what it says; lines with a "~" depend on the seed alone."""

PROGRAMS = programs_of(TEXT)

KEPT = set(re.split(", ", "asyncio, logging, multiprocessing, pydantic, random, signal, socket, sqlite3, subprocess"))
"""One for each mechanism: a loop of events, files, locks, code in C that looks at the clock, chance, signals, sockets,
other programs. `make interpreters` and `make test-all` run all."""

TWICE = share({"random", "sqlite3"}, set(PROGRAMS))
"""Programs that run a second time, and must say the same to the letter."""


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in KEPT else at_length) for name in PROGRAMS])
def test_package_lives_in_simulated_time(name: str, tmp_path: Path) -> None:
    if find_spec(name.partition(".")[0]) is None:
        pytest.skip(f"{name} is not installed")
    program, expected = PROGRAMS[name]
    (tmp_path / "program.py").write_text(program)

    def run() -> tuple[str, str]:
        """Return what the program, and KiKS beside it, has said, and KiKS's last lines, with the state."""
        done = forked.run("run", str(tmp_path / "program.py"), env={"TMPDIR": str(tmp_path)})
        told, _, ending = done.stderr.rpartition("kiks: robot 1: ")
        return done.stdout + told, ending

    said, ending = run()
    assert re.sub(r"^~.*\n", "", said, flags=re.MULTILINE) == expected
    assert re.search("state [0-9a-f]{16}\n", ending)
    if name in TWICE:
        assert run() == (said, ending)
