"""The requests of the toolbox: a table of handlers, and the handlers of sessions and ports."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

from kiks.errors import HaltError, KiksError, ParameterError, shown
from kiks.model.arena import Arena
from kiks.model.arena_file import save_arena
from kiks.model.kad import save_kad
from kiks.sim.from_project import spec_of
from kiks.toolbox.matlab_arenas import arena_from_matrix, settled
from kiks.toolbox.own_turrets import TurretOrder, parse_turrets
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.wire_format import (
    escape,
    matrix_text,
    number_text,
    numbers_text,
    parse_matrices,
    parse_numbers,
    unescape,
)
from kiks.toolbox.world_requests import WORLD_REQUESTS, parse_port
from kiks.version import __version__

WORDS_MAX = 100_000
"""Longest request, except for a world [characters]."""

ANSWER_MAX = 90_000_000
"""Longest answer [characters]: a frame has eight digits for its length."""

REASON_MAX = 400
"""Longest error message [characters]; a longer one is cut in the middle."""

PATH_MAX = 4000
"""Longest file name [characters]."""

PAUSE_MAX_S = 1e6
"""Longest pause [s]: eleven days."""

REFUSED, HALTED = "-", "."
"""First character of an answer that is an error, and of one to a program that was halted: its ports are closed."""

HALT_MESSAGE = (
    "Simulation halted: Halt was pressed on the desk. The robots stop, and the ports are closed. kiks_kopen opens them "
    "again."
)

_log = logging.getLogger("kiks.toolbox")

Act = Callable[[SessionClient, str], str | None]
"""A handler of requests: it gets the words after the name, and returns the result, None for an empty one."""


def answer(client: SessionClient, line: str) -> str:
    """Return the answer to a request line; never raises."""
    name, _, words = line.partition(" ")
    client.asked = 0
    try:
        act = REQUESTS.get(name)
        if act is None:
            raise ParameterError(
                f"a request must be one that this KiKS knows, but it was {shown(name)}. Use the toolbox of the same "
                "version: `kiks matlab` tells where it is."
            )
        if len(words) > WORDS_MAX and act is not _world:
            raise ParameterError(
                f"a request must have at most {WORDS_MAX} characters, but this one, {shown(name)}, has {len(words)}."
            )
        if client.awaited.is_halted and act is not _poll:
            raise HaltError(HALT_MESSAGE)
        result = act(client, words) or ""
        if len(result) > ANSWER_MAX:
            raise ParameterError(
                f"an answer must have at most {ANSWER_MAX} characters, but this one, to {shown(name)}, has "
                f"{len(result)}. Ask for less: a path begins anew when the port is opened anew."
            )
        if client.awaited.is_halted:
            raise HaltError(HALT_MESSAGE)
        return f"+{client.stamp()}{result}"
    except TurretOrder as asked:
        number, order = asked.args
        return f"?{client.stamp()}{number} {escape(order)}"
    except KiksError as error:
        if client.take_halt():
            return f"{HALTED}{client.stamp()}{escape(HALT_MESSAGE)}"
        why = str(error)
    except OSError as error:
        why = f"{shown(name)} must be able to use its file, but is not: {shown(error.strerror)}. Give another."
    except MemoryError:
        why = f"this computer must have enough memory for {shown(name)}, but it has not. Give a smaller arena."
    except Exception as error:
        _log.debug("a request failed", exc_info=True)
        why = f"KiKS itself has failed at {shown(name)}: {shown(error)}. Please tell its makers."
    if len(why) > REASON_MAX:
        why = f"{why[: REASON_MAX // 2]} ... {why[-REASON_MAX // 4 :]}"
    return f"{REFUSED}{client.stamp()}{escape(why)}"


# ---- the desk ----


def _poll(client: SessionClient, words: str) -> None:
    """Let an idle program, at its prompt, take what people have typed; it has nothing to be halted.

    With a word that is the prompt of Octave's debugger, and the program stands.
    """
    client.take_halt()
    if words:
        client.stand()


def _stood(client: SessionClient, words: str) -> None:
    (thought_s,) = parse_numbers(words.split(), 1, "a time")
    client.go_on(max(0.0, thought_s))  # NaN is 0, too


def _typed(client: SessionClient, words: str) -> None:
    """Show what a typed command has printed."""
    client.session.log(unescape(words))


# ---- worlds ----


def _path(text: str) -> str:
    """Return the file name in a text."""
    path = unescape(text)
    if "\0" in path or not 0 < len(path) <= PATH_MAX:
        raise ParameterError(
            f"a file's name must have 1 to {PATH_MAX} characters, none of them NUL, but it was {shown(path)}."
        )
    return path


def _set(client: SessionClient, words: str) -> None:
    name, _, value = words.partition(" ")
    client.session.settings = client.session.settings.changed(name, unescape(value))


def _world(client: SessionClient, words: str) -> str:
    """Begin a world; return a line for each thing that was moved to a free place."""
    session = client.session
    kind, _, rest = words.partition(" ")
    moves: list[str] = []
    if session.given is not None:
        client.close(0)
        return escape(f"The arena has no effect: {session.given.why_not}")
    if kind == "default":
        session.begin_arena(Arena.default())
    elif kind == "file":
        session.begin_file(_path(rest))
    elif kind == "matrix":
        arena, moves = _arena(client, rest)
        session.begin_arena(arena)
    else:
        raise ParameterError(f"a world must be default, file or matrix, but it was {shown(kind)}.")
    # They belonged to the old world, and this client asked for a new one: no error.
    client.close(0)
    return escape("\n".join(moves))


def _arena(client: SessionClient, text: str) -> tuple[Arena, list[str]]:
    codes, *greys = parse_matrices(text)
    settings = client.session.settings
    arena = arena_from_matrix(codes, *greys, wall=settings.wall, ball=settings.ball, cylinder=settings.cylinder)
    robot = spec_of(settings.project_robot, settings.project_of(arena), settings.folder)
    return settled(arena, robot.body.radius_mm)


def _save(client: SessionClient, words: str) -> None:
    path = _path(words)
    project = client.session.present_project()
    suffix = Path(path).suffix.lower()
    if suffix == ".kiks":
        project.save(path)
    elif suffix == ".kad":
        save_kad(project.arena, path)
    elif suffix == ".toml":
        save_arena(project.arena, path)
    else:
        raise ParameterError(f"a world's file must end in .kad, .kiks or .toml, but it was {shown(path)}.")


def _print(client: SessionClient, words: str) -> None:
    client.last_line = client.session.log(unescape(words))


def _print_over(client: SessionClient, words: str) -> None:
    """Replace what this program has printed last, unless the log has got other lines since."""
    client.last_line = client.session.log(unescape(words), over=client.last_line)


def _checkpoint(client: SessionClient, words: str) -> None:
    client.do(lambda sim: None)
    client.session.mark()


def _record(client: SessionClient, words: str) -> None:
    path = Path(_path(words)) if words else None
    client.do(lambda sim: client.session.record(path))


def _film(client: SessionClient, words: str) -> None:
    number, _, path = words.partition(" ")
    client.begin_film(parse_port(number), Path(_path(path)))


def _reset(client: SessionClient, words: str) -> None:
    client.do(lambda sim: None)
    client.session.reset()


# ---- ports ----


def _open(client: SessionClient, words: str) -> None:
    number, _, rest = words.partition(" ")
    (baud,) = parse_numbers(rest.split(), 1, "baud")
    if not parse_port(number) or not baud > 0:
        raise ParameterError(
            f"a simulated port must be -1, -2 and so on, and have a speed, but it was {shown(words)}. Open [-1 9600 1]."
        )
    client.open(parse_port(number), round(baud))


def _close(client: SessionClient, words: str) -> None:
    client.close(parse_port(words))


def _send(client: SessionClient, words: str) -> str:
    number, _, text = words.partition(" ")
    return escape(client.send(parse_port(number), unescape(text)))


def _ask(client: SessionClient, words: str) -> str:
    """Send a command without escape sequences."""
    number, _, text = words.partition(" ")
    return escape(client.send(parse_port(number), text + "\n"))


def _turrets(client: SessionClient, words: str) -> None:
    client.turrets = parse_turrets(words)


def _order(client: SessionClient, words: str) -> str:
    """Send an order for a turret of the program's own, with its reply in a second line."""
    number, _, text = words.partition(" ")
    order, _, reply = unescape(text).partition("\n")
    return escape(client.send_order(parse_port(number), order, reply))


def _time(client: SessionClient, words: str) -> str:
    time_s = client.time_s(parse_port(words))
    return "" if time_s is None else number_text(time_s)


def _pass(client: SessionClient, words: str) -> None:
    client.opened(parse_port(words)).port.ask_ns()


def _pause(client: SessionClient, words: str) -> None:
    (seconds,) = parse_numbers(words.split(), 1, "a pause")
    if not 0 <= seconds <= PAUSE_MAX_S:
        raise ParameterError(f"a pause must be a time from 0 to {PAUSE_MAX_S:g} s, but it was {seconds:g}.")
    client.pause(seconds)


def _rest(client: SessionClient, words: str) -> str:
    """Pause, unless the program must do so itself; return which."""
    if client.waits_itself():
        return "1"
    _pause(client, words)
    return "0"


def _tic(client: SessionClient, words: str) -> None:
    (ago_s,) = parse_numbers(words.split() or ["0"], 1, "a time")
    client.ask_clock().tic(round(ago_s * 1e6))


def _toc(client: SessionClient, words: str) -> str:
    passed_us = client.ask_clock().toc_us()
    return "" if passed_us is None else str(passed_us)


REQUESTS: dict[str, Act] = {
    "version": lambda client, words: __version__,
    "set": _set,
    "world": _world,
    "active": lambda client, words: str(int(client.session.has_begun)),
    "clients": lambda client, words: str(len(client.session.clients)),
    "desk": lambda client, words: client.session.url,
    "poll": _poll,
    "stood": _stood,
    "typed": _typed,
    "save": _save,
    "read": lambda client, words: matrix_text(Arena.load(_path(words)).brightness[::-1]),
    "print": _print,
    "print_over": _print_over,
    "checkpoint": _checkpoint,
    "reset": _reset,
    "record": _record,
    "film": _film,
    "film_save": lambda client, words: str(client.save_film()),
    "state": lambda client, words: client.do(lambda sim: sim.state_hash()),
    "open": _open,
    "close": _close,
    "send": _send,
    "ask": _ask,
    "turrets": _turrets,
    "order": _order,
    "listen": lambda client, words: escape(client.listen(parse_port(words))),
    "time": _time,
    "pass": _pass,
    "pause": _pause,
    "rest": _rest,
    "clock": lambda client, words: str(client.ask_clock().now_us()),
    "tic": _tic,
    "toc": _toc,
    "pace": lambda client, words: numbers_text(100.0 * speed for speed in client.pace()),
    **WORLD_REQUESTS,
}
"""Handlers of requests by name."""
