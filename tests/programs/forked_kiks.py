"""The command `kiks`, which the process of tests/forked.py runs in a fork. This file imports little, to start fast."""

import json
import os
import signal
import socket
import sys

# Ctrl-C in Octave is meant for the program there.
signal.signal(signal.SIGINT, signal.SIG_IGN)
_, name, *words = sys.argv
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as connection:
    connection.connect(name)
    request = {"words": words, "code": None, "cwd": os.getcwd(), "env": dict(os.environ)}
    socket.send_fds(connection, [json.dumps(request).encode()], [0, 1, 2])
    # Their ends show that the fork has closed them.
    for descriptor in (0, 1, 2):
        os.close(descriptor)
    os._exit(int(connection.recv(100) or 1) & 0xFF)
