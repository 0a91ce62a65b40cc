"""`kiks run --join`: a program here drives a robot of a world on another computer."""

from __future__ import annotations

import signal
import socket
from collections.abc import Sequence

from kiks.cli.options import parse_words, say
from kiks.ending import INTERRUPTED, noting_endings
from kiks.errors import LinkError, ParameterError


def run_joined(address: str, words: Sequence[str]) -> int:
    """Run a program in the time of a world on another computer; return its exit code.

    Args:
        address: The address of its robot, which `kiks host` prints there.
        words: The program and its arguments.
    """
    commands = parse_words(list(words))
    if len(commands) != 1:
        raise ParameterError(
            f"--join must have one program, for its address is that of one robot, but there were {len(commands)}. "
            "Run each one with the address of its robot."
        )
    import kiks.script  # noqa: F401  (under an interpreter that it does not know, KiKS ends here)
    from kiks.ports.joining import Address, HostSocket, relay
    from kiks.ports.program_process import Process
    from kiks.ports.resources import opening

    (command,) = commands
    command.check_file()
    host = HostSocket(Address.parse(address))
    say(f"robot {host.robot} at {host.place}, thinking {host.start.thinking}.")
    start = command.added_to(host.start)
    with opening("the program's line"):
        here, there = socket.socketpair()
    with here:
        with there:
            process = Process(command.name, start, there, keeps_output=False)
        signals: list[int] = []

        def pass_on(number: int) -> None:
            """End the program, which has got the Ctrl-C of its terminal itself."""
            signals.append(number)
            if len(signals) > 1:
                process.kill()
            elif number != signal.SIGINT:
                process.interrupt()

        with noting_endings(pass_on):
            try:
                relay(host, here)
                if host.farewell:
                    say(f"the host has ended the program: {host.farewell}")
                    process.kill()
            except LinkError:
                process.kill()
                raise
            finally:
                process.wait()
    if signals:
        return INTERRUPTED
    code = process.code or 0
    return code if code >= 0 else 128 - code
