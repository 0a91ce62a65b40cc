"""Files, pipes and sockets of a program: it may talk to itself, and its files are as old as its clock says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from tests.served import fresh

from kiks.script.runner import run_here

Run = Callable[[str], tuple[int, str]]


@pytest.fixture
def run(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a program in this process, in an empty folder; return its exit code and what it says."""
    monkeypatch.chdir(tmp_path)

    def run(text: str) -> tuple[int, str]:
        program = tmp_path / "program.py"
        program.write_text(text)
        code = run_here(fresh(), program, [], {})
        out, told = capsys.readouterr()
        return code, out + told

    return run


TALKS = {
    "a pair of sockets": """
import socket, threading, time
here, there = socket.socketpair()
def send():
    time.sleep(2)
    there.sendall(b"hello" * 100_000)
    there.close()
threading.Thread(target=send).start()
count = 0
while data := here.recv(4096):
    count += len(data)
print(count, time.monotonic())
here.close()
here, there = socket.socketpair()
here.settimeout(1.5)
try:
    here.recv(1)
except TimeoutError as error:
    print(error, time.monotonic())
here.close()
there.close()
""",
    "a pipe": """
import os, threading, time
out, into = os.pipe()
def write():
    with os.fdopen(into, "w") as file:
        print("first", file=file, flush=True)
        time.sleep(1)
        print("last", file=file)
threading.Thread(target=write).start()
with os.fdopen(out) as file:
    print(file.readline().strip(), time.monotonic(), file.read().strip(), time.monotonic())
""",
    "a server": """
import http.server, threading, time, urllib.request
class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        time.sleep(1)
        self.send_response(200)
        self.end_headers()
        self.wfile.write(self.path.encode())
    def log_message(self, *_): pass
server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
thread = threading.Thread(target=server.serve_forever)
thread.start()
print(urllib.request.urlopen(f"http://localhost:{server.server_port}/page").read(), time.monotonic())
server.shutdown()
thread.join()
server.server_close()
""",
    "streams of asyncio": """
import asyncio, time
async def answer(reader, writer):
    line = await reader.readline()
    await asyncio.sleep(0.5)
    writer.write(line.upper())
    await writer.drain()
    writer.close()
async def main():
    server = await asyncio.start_server(answer, "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
    writer.write(b"line\\n")
    print(await reader.readline(), time.monotonic())
    writer.close()
    server.close()
asyncio.run(main())
""",
}

SAYS = {
    "a pair of sockets": "500000 2.0\ntimed out 3.5\n",
    "a pipe": "first 0.0 last 1.0\n",
    "a server": "b'/page' 1.0\n",
    "streams of asyncio": "b'LINE\\n' 0.5\n",
}


@pytest.mark.parametrize("talk", TALKS)
def test_program_may_talk_to_itself(run: Run, talk: str) -> None:
    assert run(TALKS[talk]) == (0, SAYS[talk])


@pytest.mark.parametrize(
    "text",
    [
        "import socket\nhere, there = socket.socketpair()\nhere.recv(1)\n",
        "import os\nout, into = os.pipe()\nos.read(out, 1)\n",
        "import select, socket\nhere, there = socket.socketpair()\nselect.select([here], [], [])\n",
    ],
)
def test_program_that_waits_for_itself_for_ever_ends_with_one_line(run: Run, text: str) -> None:
    code, told = run(text)
    assert code == 1
    assert told.startswith("kiks: some thread of a program must be able to go on, but all wait for ever: MainThread")
    assert told.count("\n") == 1


def test_network_is_refused_with_the_line_of_the_program(run: Run) -> None:
    code, told = run("import urllib.request\n\nurllib.request.urlopen('http://example.org/')\n")
    assert code == 1
    assert "talk to its robots alone, but it used the network (program.py, line 3)" in told


AGES = """
import os, shutil, time
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
time.sleep(1)
print(age("old"))
"""


def test_files_are_as_old_as_the_clock_says(run: Run) -> None:
    assert run(AGES) == (0, "True\n2.0\n0.0\n1.0 1.0 [1.0]\n1000000000.0 500000000.0\n1000000000.0\n0.0\n1.0\n")


def test_ports_are_in_their_folder(run: Run) -> None:
    looks = """
import glob, os
from pathlib import Path
print(glob.glob("/dev/ttyUSB*"), [str(path) for path in Path("/dev").glob("ttyUSB*")])
print([name for name in os.listdir("/dev") if "ttyUSB" in name], Path("/dev/ttyUSB0").is_char_device())
print([(entry.path, entry.is_file()) for entry in os.scandir("/dev") if "ttyUSB" in entry.name])
"""
    assert run(looks) == (
        0,
        "['/dev/ttyUSB0'] ['/dev/ttyUSB0']\n['ttyUSB0'] True\n[('/dev/ttyUSB0', False)]\n",
    )
