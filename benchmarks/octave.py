"""How fast programs in Octave run: the demo follow at 9600 baud, and bare exchanges, through the toolbox in matlab/.

Run: python benchmarks/octave.py [--json]. Each figure is a median. The peers, in the same run: what Octave's tcpclient
does with a server that answers a fixed line at once and simulates nothing, and a process at the ends of two pipes that
does the same: as fast as anything can be that is not in Octave itself.
"""

from __future__ import annotations

import argparse
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from calibration import report

MATLAB = Path(__file__).parent.parent / "matlab"

PROGRAM = """
addpath('{matlab}'); addpath('{matlab}/demos');
kiks();
follow(-1, 9600, 60);
runs = zeros(1, {repeats});
for k = 1:{repeats}
    begin = builtin('tic'); follow(-1, 9600, {seconds}); runs(k) = {seconds} / builtin('toc', begin);
end
fprintf('follow %g\\n', median(runs));
ref = kiks_kopen([-1 9600 1]);
for k = 1:{repeats}
    begin = builtin('tic');
    for each = 1:2000, kiks_ksend(['N' 10], ref); end
    runs(k) = 2000 / builtin('toc', begin);
end
fprintf('exchanges %g\\n', median(runs));
kiks_kclose(ref); kiks_quit
[to, from, process] = popen2('{python}', {{'{echo}'}}, true);
for k = 1:{repeats}
    begin = builtin('tic');
    for each = 1:2000, fputs(to, ['N' 10]); fflush(to); fread(from, [1 32], '*char'); end
    runs(k) = 2000 / builtin('toc', begin);
end
fprintf('pipe %g\\n', median(runs));
fclose(to); fclose(from);
pkg load instrument-control
link = tcpclient('127.0.0.1', {port});
for k = 1:{repeats}
    begin = builtin('tic');
    for each = 1:1000
        write(link, uint8(['N' 10]));
        reply = '';
        while isempty(reply) || reply(end) ~= 10
            count = link.NumBytesAvailable;
            if count > 0, reply = [reply char(read(link, count))]; end
        end
    end
    runs(k) = 1000 / builtin('toc', begin);
end
fprintf('tcpclient %g\\n', median(runs));
"""

ECHO = """
import os

while os.read(0, 99):
    os.write(1, b"n,1023,1023,0,0,0,0,0,1023,1023\\n")
"""

FIGURES = ("follow", "exchanges", "pipe", "tcpclient")


def echo_server() -> int:
    """Answer each message with 32 characters, in a thread; return the port."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve() -> None:
        connection, _ = listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        while connection.recv(99):
            connection.sendall(b"n,1023,1023,0,0,0,0,0,1023,1023\n")

    threading.Thread(target=serve, daemon=True).start()
    return int(listener.getsockname()[1])


def main() -> None:
    """Measure and report."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--json", action="store_true", help="one JSON object a line")
    arguments.add_argument("--repeats", type=int, default=9, help="how often each figure is measured")
    arguments.add_argument("--seconds", type=int, default=120, help="simulated seconds of the demo")
    options = arguments.parse_args()
    octave = shutil.which("octave-cli")
    if octave is None:
        sys.exit("benchmarks/octave.py needs Octave: apt-get install octave octave-instrument-control")
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "measure.m"
        echo = Path(folder) / "echo.py"
        echo.write_text(ECHO)
        program.write_text(
            PROGRAM.format(
                matlab=MATLAB,
                python=sys.executable,
                echo=echo,
                repeats=options.repeats,
                seconds=options.seconds,
                port=echo_server(),
            )
        )
        done = subprocess.run(
            [octave, "--no-gui", "-q", str(program)],
            capture_output=True,
            text=True,
            timeout=1200,
            env={**os.environ, "KIKS_WINDOW": "0", "KIKS_COMMAND": f"{sys.executable} -m kiks"},
        )
    words = [line.split() for line in done.stdout.splitlines()]
    found = {each[0]: float(each[1]) for each in words if len(each) == 2 and each[0] in FIGURES}
    if len(found) < len(FIGURES):
        sys.exit(done.stdout + done.stderr)
    report(
        [
            ("octave.follow_speedup", found["follow"], "x real time"),
            ("octave.exchanges_per_s", found["exchanges"], "1/s"),
            ("octave.exchanges_over_tcpclient", found["exchanges"] / found["tcpclient"], "a bare tcpclient's"),
            ("octave.exchanges_over_pipe", found["exchanges"] / found["pipe"], "a bare pipe's"),
        ],
        as_json=options.json,
    )


if __name__ == "__main__":
    main()
