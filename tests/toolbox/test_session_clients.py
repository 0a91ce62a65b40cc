"""Clients of a session, with requests as the toolbox sends them."""

import asyncio
import threading
import time
import tracemalloc
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.at_length import share
from tests.guard import GUARD_S, wait_until

from kiks.errors import ParameterError
from kiks.model.arena import Arena
from kiks.ports.messages import AwaitedAnswer
from kiks.recording.mcap_file import DiskSpace
from kiks.recording.recording import Recording
from kiks.sim.simulation import Simulation
from kiks.toolbox.requests import REQUESTS, answer
from kiks.toolbox.session import Session
from kiks.toolbox.session_client import SessionClient
from kiks.toolbox.wire_format import matrix_text, parse_matrices

HEAD = 20
"""Length of the sign, the port and the time before the result."""


class Asker:
    """Sends requests; returns the answer to the last, or an error."""

    def __init__(self, session: Session, number: int = 1) -> None:
        self.client = SessionClient(session, number)

    def __call__(self, *requests: str) -> str:
        for request in requests:
            told = self.told(request)
            assert told[0] == "+", told
        return told[HEAD:]

    def told(self, request: str) -> str:
        return answer(self.client, request)

    def refused(self, request: str) -> str:
        told = self.told(request)
        assert told[0] == "-", told
        return told[HEAD:]

    def numbers(self, request: str) -> list[float]:
        return [float(word) for word in self(request).split()]


@contextmanager
def running(session: Session) -> Iterator[Session]:
    """Run the session's own thread."""
    is_over = threading.Event()

    def go_round() -> None:
        while not is_over.is_set():
            session.round()

    thread = threading.Thread(target=go_round, daemon=True)
    thread.start()
    try:
        yield session
    finally:
        is_over.set()
        thread.join(GUARD_S)
        session.close()
        assert not thread.is_alive()


@pytest.fixture
def session() -> Iterator[Session]:
    with running(Session()) as each:
        yield each


@pytest.fixture
def ask(session: Session) -> Asker:
    """Return a program whose port -1 is open in the default world."""
    asker = begun(session)
    asker("open 1 9600")
    return asker


def begun(session: Session, *settings: str, world: str = "default") -> Asker:
    ask = Asker(session)
    ask(*(f"set {setting}" for setting in ("thinking none", *settings)), f"world {world}")
    return ask


def floor(*shape: int) -> str:
    """Return an arena without anything in it."""
    return f"matrix {matrix_text(np.zeros(shape))}"


def test_a_session_equals_a_port_in_memory(session: Session) -> None:
    """A session has the same physics, line and clock as a port in memory, to the bit."""
    ask = begun(session, "seed 3", "turrets k213")
    ask("open 1 9600")
    sim = Simulation(seed=3)
    sim.fit(1, "k213")
    port = sim.port(1)
    port.timeout = 10
    for loop in range(40):
        for command in ("N", f"D,{loop % 7},{loop % 5}", "H", "T,2,L"):
            port.write(f"{command}\n".encode())
            assert ask(f"ask 1 {command}") == port.readline().decode().rstrip()
    assert float(ask("time 1")) == pytest.approx(sim.time_s, abs=1e-9)
    assert ask("state") == sim.state_hash()


def test_polling_lets_time_pass_and_nothing_moves_without_a_port(ask: Asker) -> None:
    ask("ask 1 D,5,5")
    for poll in ("time 1", "pose 1"):
        y = ask.numbers("pose 1")[1]
        ask(*[poll] * 3000)
        assert ask.numbers("pose 1")[1] < y - 10
    ask("close 1")
    state = ask("state")
    ask(*["objects"] * 100)
    assert ask("state") == state


def test_thinking_time_passes_live_in_a_window(session: Session) -> None:
    """Thinking time counts once: the robot drives for exactly as long as the program has thought."""
    ask = Asker(session)
    ask("set thinking live", "world default")
    begin_s, begin_ns = time.monotonic(), session.world.now_ns
    session.desk.gate.set_speed(1.0, begin_ns)
    ask("open 1 9600", "ask 1 D,5,5")
    driven_ns = begin_ns + 500_000_000
    wait_until(lambda: session.world.now_ns >= driven_ns)  # time passes without a request
    ask("ask 1 H")
    end_ns = session.world.now_ns
    thought_s = time.monotonic() - begin_s
    assert (end_ns - begin_ns) * 1e-9 < thought_s + 0.1, "time that has passed counts once"


def test_a_pause_lets_time_pass_and_distances_and_paths_begin_when_the_port_is_opened(session: Session) -> None:
    ask = begun(session)
    for _ in range(2):
        ask("open 1 9600")
        before = ask.numbers("pose 1")
        assert ask.numbers("distances 1") == pytest.approx([0, 0, 0], abs=1e-3)
        ask("ask 1 D,5,5", "pause 1", "ask 1 D,0,0", "pause 0.2")
        forwards, backwards, straight = ask.numbers("distances 1")
        assert (forwards, backwards) == (pytest.approx(straight, abs=1), pytest.approx(0, abs=1e-3))
        assert forwards == pytest.approx(40, abs=3), "1 s at 40 mm/s"
        assert before[1] - ask.numbers("pose 1")[1] == pytest.approx(forwards, abs=1), "upwards: y is less"
        path = parse_matrices(ask("path 1"))[0]
        assert path.shape[0] == 2
        assert 20 < path.shape[1] < 60
        assert np.ptp(path[0]) < 1
        assert np.ptp(path[1]) == pytest.approx(40, abs=5)
        ask("close 1")


def test_a_long_path_keeps_its_ends_in_few_points(session: Session) -> None:
    ask = Asker(session)
    ask("set path_points 40", "world default", "open 1 9600")
    start = ask.numbers("pose 1")
    ask("ask 1 D,5,5", "pause 3")
    path = parse_matrices(ask("path 1"))[0]
    assert 20 <= path.shape[1] <= 40, "3 s have 75 points; every second one is left"
    assert path[:, 0] == pytest.approx(start[:2], abs=0.1)
    assert path[:, -1] == pytest.approx(ask.numbers("pose 1")[:2], abs=5)
    ask("close 1")
    points = parse_matrices(ask("path 1"))[0].shape[1]
    assert points == pytest.approx(path.shape[1], abs=1), "a closed port has a path, and its last pose"
    # A new port begins with all points again.
    ask("open 1 9600", "pause 1")
    assert 23 <= parse_matrices(ask("path 1"))[0].shape[1] <= 27


def test_a_late_reply_answers_nothing_else_and_replies_of_several_lines_are_read_completely(ask: Asker) -> None:
    assert ask(r"send 1 N\nH\n").startswith("n,")
    assert ask("ask 1 H").startswith("h,")
    assert ask("send 1 H").startswith("h,"), "each call is a command of its own, even without a terminator"
    assert ask("send 1 D,5,5") == "d"
    assert ask(r"send 1 \n") == "", "empty lines are not answered"
    assert ask("ask 1 E").startswith("e,")
    assert ask("ask 1 help")
    assert ask("listen 1").count(r"\n") > 3
    assert ask("ask 1 H").startswith("h,")


def test_fractions_are_rounded(ask: Asker) -> None:
    for command, counters in {"5.5,-5.5": "6,-6", ".4,2.": "0,2", " 1.25e2 ,-0.1": "125,0", "+7.0,8": "7,8"}.items():
        assert (ask(f"ask 1 G,{command}"), ask("ask 1 H")) == ("g", f"h,{counters}")
    for command in ("1.5.5,3", "x.5,3", "1e400.5,3", "9" * 99 + ".5,3"):
        assert (ask(f"ask 1 G,{command}"), ask("ask 1 H")) == ("z,Protocol error", "h,7,8")


def test_the_pace_stays_after_the_ports_are_closed(session: Session) -> None:
    ask = begun(session)
    assert ask.numbers("pace") == [100, 100]
    ask("open 1 9600", "pause 1000")
    assert min(ask.numbers("pace")) > 100
    before = ask("state")
    ask("close 1")
    last = ask.numbers("pace")
    assert last[0] > 100
    assert ask.numbers("pace") == last
    assert ask("state") == before, "to be asked takes no time"


def test_every_port_has_its_own_robot_and_is_opened_once(session: Session) -> None:
    ask = begun(session)
    ask("open 1 9600", "open 2 9600", "open 3 9600")
    poses = {ask(f"pose {port}") for port in (1, 2, 3)}
    assert len(poses) == 3
    ask("close 0", "open 2 9600")
    assert ask("pose 2") in poses
    assert session.world.robot_count == 3
    assert "use kiks_kclose([])" in ask.refused("open 2 9600").lower()
    ask("close 2", "close 2", "open 2 19200")
    assert "baudrate must be" in ask.refused("open 4 7")
    assert "must be -1, -2" in ask.refused("open 0 9600")


def test_a_new_world_closes_ports_with_an_error(session: Session, ask: Asker) -> None:
    ask("world default")
    assert "must be open, but it is not" in ask.refused("ask 1 N")
    assert ask("open 1 9600", "ask 1 N").startswith("n,")
    Asker(session, 2)("world default")
    assert "another world has taken its place" in ask.refused("ask 1 N")
    assert ask("open 1 9600", "ask 1 N").startswith("n,")


def cancelled(session: Session, ask: Asker, number: int, request: str, then: str) -> list[str]:
    """Cancel a request to a paused world, let time go on, and return its answer and that to the next request."""
    awaited = AwaitedAnswer()
    ask.client.leave()
    ask.client = SessionClient(session, number, awaited)
    told: list[str] = []
    is_paused = threading.Event()

    def drive() -> None:
        ask("open 1 9600")
        session.desk.gate.pause(session.world.now_ns)
        is_paused.set()
        told.append(ask.told(request))
        awaited.is_cancelled = False
        session.desk.gate.go_on()
        told.append(ask.told(then))

    thread = threading.Thread(target=drive)
    thread.start()
    assert is_paused.wait(GUARD_S)
    awaited.is_cancelled = True
    wait_until(lambda: told or ask.client.cancel())
    thread.join(GUARD_S)
    assert not thread.is_alive()
    return told


@pytest.mark.slow
@pytest.mark.parametrize("request_", ["ask 1 N", "pause 5", "time 1", "pose 1", "close 1", "listen 1"])
def test_requests_to_a_paused_world_can_be_cancelled(session: Session, request_: str) -> None:
    told = cancelled(session, begun(session), 1, request_, "ask 1 N")
    assert told[0][0] == "+" or "the program was interrupted" in told[0]
    assert told[1][HEAD:].startswith("n,") or request_ == "close 1", told


def test_an_interrupted_pause_in_a_shared_world_has_not_run_ahead_of_it(session: Session) -> None:
    other = begun(session)
    other("open 1 9600", "close 1")
    told = cancelled(session, Asker(session, 2), 2, "pause 1e6", "time 1")
    assert "the program was interrupted" in told[0]
    assert float(told[1][HEAD:]) < 5


def test_waiting_for_other_programs_can_be_cancelled(session: Session) -> None:
    awaited = AwaitedAnswer()
    ask = begun(session, "programs 2")
    ask.client.leave()
    ask.client = SessionClient(session, 1, awaited)
    told: list[str] = []
    thread = threading.Thread(target=lambda: told.append(ask.told("open 1 9600")))
    thread.start()
    wait_until(lambda: told or setattr(awaited, "is_cancelled", True))
    thread.join(GUARD_S)
    assert "the program was interrupted" in told[0]


def test_two_programs_drive_two_robots_in_one_world(session: Session) -> None:
    """Each in its own thread, like two Octaves; the result does not depend on which one is faster."""
    codes = np.zeros((500, 500))
    codes[249, 129], codes[249, 369] = -360, -90

    def run() -> tuple[list[str], list[str], str]:
        first = begun(session, "seed 4", "programs 2", world=f"matrix {matrix_text(codes)}")
        second = Asker(session, 2)

        def loop(ask: Asker) -> list[str]:
            ask("open 1 9600")
            told = []
            for step in range(60):
                told += [ask("ask 1 N"), ask(f"ask 1 D,{3 + ask.client.number},{step % 6}"), ask("time 1")]
            ask("close 1")
            return told

        with ThreadPoolExecutor() as pool:
            told = list(pool.map(loop, (first, second)))
        for ask in (first, second):
            ask.client.leave()
        return *told, Asker(session)("state")

    runs = [run() for _ in range(3)]
    assert len(runs[0][0]) == len(runs[0][1]) == 180
    assert runs[0] == runs[1] == runs[2]


@pytest.mark.slow
def test_a_client_that_leaves_frees_its_robot(session: Session) -> None:
    first = begun(session)
    first("open 1 9600")
    second = Asker(session, 2)
    second("open 1 9600")
    assert session.world.robot_count == 2
    first.client.leave()
    third = Asker(session, 3)
    third("open 1 9600")
    assert session.world.robot_count == 2
    assert third("ask 1 N").startswith("n,")


def test_objects_are_listed_lights_first_and_can_be_moved(session: Session) -> None:
    ask = begun(session, world=floor(500, 600))
    ask("spawn 2 100 400", "spawn 1 50 60", "spawn 3 200 400")
    objects = parse_matrices(ask("objects"))[0]
    assert objects[:, 0].tolist() == [1, 2, 3]
    assert objects[:, 1:3].tolist() == [[50, 60], [100, 400], [200, 400]]
    assert ask("set_object 2 101 400 100 1.5") == "1", "a short move, too: what it stands on itself is free"
    assert ask("set_object 2 NaN NaN 100 1.5") == "1"
    row = parse_matrices(ask("objects"))[0][1]
    assert row.tolist() == [2, 101, 400, pytest.approx(100), pytest.approx(1.5)]
    assert ask("set_object 2 200 400 50 0") == "0", "there is the cylinder"
    row = parse_matrices(ask("objects"))[0][1]
    assert row.tolist() == [2, 101, 400, pytest.approx(50), pytest.approx(0)], "but it rolls"
    assert ask("set_object 1 70 80 0 0") == "1"
    assert parse_matrices(ask("objects"))[0][0, 1:3].tolist() == [70, 80]
    assert "row must be one of the 3" in ask.refused("set_object 4 1 1 1 1")


def test_objects_are_deleted_by_their_rows_and_those_without_a_place_get_one(session: Session) -> None:
    ask = begun(session, world=floor(500, 600))
    ask("spawn 2 100 400", "spawn 1 50 60", "spawn 3 200 400", "spawn 1 80 90", "spawn 2 300 400")
    assert "row must be one of the 5" in ask.refused("delete 1 6")
    ask("delete 4 1 4")
    objects = parse_matrices(ask("objects"))[0]
    assert objects[:, :3].tolist() == [[1, 80, 90], [2, 100, 400], [2, 300, 400]]
    ask("reset")
    assert parse_matrices(ask("objects"))[0].tolist() == objects.tolist()
    ask("delete")
    assert parse_matrices(ask("objects"))[0].tolist() == objects.tolist()
    ask(f"world {floor(500, 600)}", *["spawn 3 NaN NaN"] * 5, "spawn 1 NaN NaN")
    objects = parse_matrices(ask("objects"))[0]
    assert objects[:, 0].tolist() == [1, 3, 3, 3, 3, 3]
    assert len({tuple(place) for place in objects[:, 1:3].tolist()}) == 6
    assert "must lie in the arena" in ask.refused("spawn 2 700 10")
    assert "type must be" in ask.refused("spawn 4 10 10")


def test_a_robot_is_moved_to_a_free_place(ask: Asker) -> None:
    assert ask("set_robot 1 100 200 0.5") == "1"
    assert ask.numbers("pose 1") == [100, 200, 0.5]
    assert ask("set_robot 1 5 5 0.5") == "0"
    assert ask.numbers("pose 1") == [100, 200, 0.5]
    assert ask("set_robot 1 200 200 NaN") == "1"
    assert ask("ask 1 N").startswith("n,"), "the port stays open"


def test_a_reset_restores_everything(session: Session) -> None:
    ask = begun(session)
    ask("spawn 2 100 200", "open 1 9600")
    before = ask("pose 1"), ask("objects")
    ask("ask 1 D,5,5", "set_object 1 300 300 0 0", "pause 1", "reset")
    assert ask("objects") == before[1]
    assert ask.numbers("pose 1") == pytest.approx([float(word) for word in before[0].split()], abs=0.5)


def test_worlds_are_saved_and_read(session: Session, tmp_path: Path) -> None:
    codes = np.zeros((300, 400))
    codes[:10], codes[149, 99], codes[149, 299] = 1, -90, 3
    ask = begun(session, world=f"matrix {matrix_text(codes)}")
    for name in ("a.kad", "b.kiks", "c.toml"):
        ask(f"save {tmp_path / name}")
        assert np.array_equal(Arena.load(tmp_path / name).brightness[::-1] > 0, codes == 1)
        greys = parse_matrices(ask(f"read {tmp_path / name}"))[0]
        assert np.array_equal(greys > 0, codes == 1)
        ask(f"world file {tmp_path / name}")
        assert parse_matrices(ask("objects"))[0][:, 1:3].tolist() == [[300, 150]]
    assert "must end in .kad" in ask.refused(f"save {tmp_path / 'd.txt'}")
    assert "no such file" in ask.refused(f"read {tmp_path / 'none.kad'}").lower()


def test_settings_hold_for_the_next_world_and_for_arenas_of_the_desk(session: Session) -> None:
    ask = begun(session, "robot khepera_ii", "robots 2", "turrets gripper", "noise 0", "brightness 7", "ball 40")
    sim = session.world
    assert sim.robot_count == 2
    assert {spec.name for spec in sim.specs} == {"Khepera II"}
    assert {spec.body.brightness for spec in sim.specs} == {7}
    assert not sim.specs[0].is_noisy
    assert [turret.name for turret in sim.turrets(2)] == [turret.name for turret in sim.turrets(1)]
    ask("spawn 2 100 300")
    assert sim.bodies()["brightness"].tolist() == [40]
    ask("set robot nobody")
    assert "nobody" in ask.refused("world default")
    assert session.world is sim, "the old world is still there"
    begun(session, "robot ", "turrets gripper", "seed 9")
    project = session.desk.project_of(Arena.box(300, 300))
    assert (project.seed, project.robots[0].turrets, session.desk.has_old_coordinates) == (9, ("gripper",), True)


def test_latency_of_a_calibration_is_added(session: Session) -> None:
    ask = begun(session, "latency_s 0.5")
    ask("open 1 9600")
    before = float(ask("time 1"))
    ask("ask 1 H")
    assert float(ask("time 1")) - before == pytest.approx(0.5, abs=0.05)


REFUSED = """
nothing|open|open 1|open x 9600|ask 9 N|send 1|listen 1|pass 1|pause 1|pause x|world|world file|world matrix 3
world matrix 2 2 4 0|set_robot 1 2|spawn 1|set x 1|save|read|
"""


def test_bad_requests_and_those_without_a_world_get_an_error(session: Session) -> None:
    for request in ("pose 1", "path 1", "objects", "state", "save x.kad", "checkpoint", "reset"):
        told = Asker(session).told(request)
        assert (told[0] == "+" and told[HEAD:] == "") or "there must be a world first" in told, request
    ask = begun(session)
    for request in REFUSED.strip("\n").replace("\n", "|").split("|"):
        assert "KiKS itself has failed" not in ask.refused(request)
    assert ask("active") == "1"


HOSTILE = (
    *("", "x", "-1", "1 2 3 4 5 6 7", "nan", "1e300", "-5 nan inf", "99999999999999999999", "\\", "\0", "1\0"),
    *("\ufffd", "1 " + "9" * 400, "9" * 5000, "1 1e400", "1 100 100 1e20", "1 -1e308 1e308 -1e308", "1 1e9 1e9 1e6"),
    *("1 1 1 1e9 1e9", "1 nan nan 1e308 1e308", "1 nan nan -1e9 nan", "2 1e308 1e308", "2 1e9 -1e9", "1e-320", "1_0"),
    *("0x10", "\u0661", "1 " * 20_000, "a" * 99_000, "x" * 200_000, "a.kad/" * 500, "[" * 50_000),
    *("1 " + "D,9" * 3000, "1 " + "\r" * 3000, "robots 1e9", "robots nan", "seed 1e300", "seed -1", "noise 2"),
    *("turrets " + "k213 " * 9000, "thinking live:1e308", "latency_s 1e9", "wall 1e400", "robot \0", "programs 1001"),
    "response " + "9" * 5000,
)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", sorted({*REQUESTS, "nothing", "", "x" * 70_000, "\ufffd", "\0"}), ids=lambda name: name[:20]
)
def test_any_request_is_answered(session: Session, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No request ends the process or fails inside, and each refusal is one line."""
    monkeypatch.chdir(tmp_path)
    ask = begun(session, world=floor(200, 200))
    ask("spawn 1 50 50", "spawn 2 150 150", "open 1 9600")
    for words in share(HOSTILE[len(name) % 3 :: 3], HOSTILE):
        told = ask.told(f"{name} {words}")
        assert told[0] in "+-"
        assert "KiKS itself has failed" not in told, (words[:80], told)
        if told[0] == "-":
            assert len(told) < 500, words[:80]
            assert told.isprintable(), words[:80]
            # What is wrong with a file says the reader of files.
            assert len(words) <= 80 or words[:81] not in told or name in ("read", "record", "save")
    assert ask("active") == "1"
    settings = ("seed", "robot", "robots", "response", "turrets", "thinking", "programs", "latency_s", "log_lines")
    ask(*(f"set {setting} " for setting in settings), "world default", "open 1 9600")
    assert ask("ask 1 N").startswith("n,")


HUGE = {
    "2000 2000 4000000 3": "at most 10000 robots",
    "200 200 40000 1.5": "an arena's elements must be",
    "200 200 40000 1 200 200 40000 256": "greys of walls must be",
} | dict.fromkeys(
    [
        *("64000000 64000000 1 1", "8000 8000 64000000 1e300", "200 200 40000 nan", "200 200 40000 -inf", "1e9 1"),
        *("200 200 39999.5 0 0.5 0", "200 200 40000 0 200 200 40000 0 200 200 40000 0", " ".join("9" * 3000)),
    ],
    "a matrix must be",
)


def test_a_huge_matrix_header_allocates_no_memory(session: Session) -> None:
    ask = begun(session)
    for words, why in HUGE.items():
        tracemalloc.start()
        try:
            told = ask.refused(f"world matrix {words}")
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert why in told
        assert len(told) < 500
        assert peak < 100e6


def test_a_robot_may_be_a_file(session: Session, tmp_path: Path) -> None:
    ours = resources.files("kiks.model").joinpath("robots", "khepera.toml").read_text(encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_text(ours.replace("pulse_mm = 0.08 ", "pulse_mm = 0.082 "), encoding="utf-8")
    ask = begun(session, f"robot {file}", "robots 1")
    assert session.world.specs[0].body.pulse_mm == 0.082
    ask("open 1 9600", "open 2 9600")
    assert session.world.specs[1].body.pulse_mm == 0.082, "a robot that is added is of the same kind"
    ask(f"set robot {tmp_path / 'none.toml'}")
    assert "none.toml" in ask.refused("world default")


def test_a_film_shows_the_time_in_which_it_was_made_or_is_refused(session: Session, tmp_path: Path) -> None:
    ask = begun(session)
    assert "port -1 must be open" in ask.refused(f"film 1 {tmp_path}/run.webp")
    ask("open 1 9600")
    assert "a film must end in .mp4, .gif or .webp" in ask.refused(f"film 1 {tmp_path}/run.avi")
    assert "a film must go to a file that can be written" in ask.refused(f"film 1 {tmp_path}/no/run.mp4")
    ask(f"film 1 {tmp_path}/run.mp4")
    assert "a program must make one film at a time" in ask.refused(f"film 1 {tmp_path}/two.mp4")
    assert not list(tmp_path.iterdir())
    ask("film_save")
    ask("pause 1", f"film 1 {tmp_path}/run.webp", "pause 2")
    assert ask("film_save") == "51"
    assert (tmp_path / "run.webp").stat().st_size > 1000
    assert ask("film_save") == "0"
    assert session.world.loop.recorder is None
    ask(f"film 1 {tmp_path}/left.webp", "pause 1")
    ask.client.leave()
    assert (tmp_path / "left.webp").stat().st_size > 1000, "a client that leaves has its film"


def test_an_interrupted_film_is_given_up(tmp_path: Path) -> None:
    pending = AwaitedAnswer()
    with running(Session()) as session:
        ask = Asker(session)
        ask.client = SessionClient(session, 1, pending)
        ask("set thinking none", "open 1 9600", f"film 1 {tmp_path}/run.webp", "pause 1")
        pending.is_cancelled = True
        assert "The program was interrupted; the film was discarded" in ask.refused("film_save")
        assert not list(tmp_path.iterdir())


def halt(session: Session) -> None:
    """Press Halt: in another thread than that of a program."""
    desk = session.desk
    with ThreadPoolExecutor() as pool:
        pool.submit(lambda: asyncio.run(desk.halt())).result(GUARD_S)


def set_points(session: Session) -> Any:
    return session.world.world.state.robots["speed_setpoint"][0].tolist()


@pytest.mark.parametrize("is_paused", [False, True])
def test_halt_ends_a_long_pause_and_stops_the_robot(session: Session, is_paused: bool) -> None:
    """Also in a world that stands still, where the pause would never end."""
    ask = begun(session)
    desk, told, drives = session.desk, list[str](), threading.Event()

    def drive() -> None:
        ask("open 1 9600", "ask 1 D,9,7")
        asyncio.run(desk.pause() if is_paused else desk.set_speed(1.0))
        drives.set()
        told.append(ask.told("pause 100000"))

    thread = threading.Thread(target=drive)
    thread.start()
    assert drives.wait(GUARD_S)
    while not told:
        halt(session)
        thread.join(0.1)
    assert told[0][0] == "."
    assert told[0][HEAD:].startswith("Simulation halted: Halt was pressed on the desk.")
    asyncio.run(desk.go_on())
    asyncio.run(desk.set_speed(None))
    ask.told("time 1")
    assert "must be open" in ask.refused("ask 1 N")
    assert ask("open 1 9600", "pause 0.5", "ask 1 E") == "e,0,0"
    assert set_points(session) == [[0, 0]]


def test_halt_stops_every_program_at_its_next_request(session: Session) -> None:
    codes = np.zeros((500, 500))
    codes[249, 129], codes[249, 369] = -360, -90
    first = begun(session, world=f"matrix {matrix_text(codes)}")
    second = Asker(session, 2)

    def loop(ask: Asker) -> None:
        ask("open 1 9600")
        while (answer := ask.told("ask 1 D,5,5"))[0] == "+":
            pass
        assert answer[0] == "."
        assert "port -1 must be open" in ask.refused("ask 1 D,9,9")

    with ThreadPoolExecutor() as pool:
        loops = [pool.submit(loop, ask) for ask in (first, second)]
        wait_until(lambda: set_points(session) == [[5, 5], [5, 5]])
        halt(session)
        for each in loops:
            each.result(GUARD_S)
    wait_until(lambda: set_points(session) == [[0, 0], [0, 0]])
    first("open 1 9600")


def test_an_idle_program_is_halted_without_an_error(session: Session, ask: Asker) -> None:
    ask("ask 1 D,5,5")
    halt(session)
    assert (ask("poll"), ask("time 1")) == ("", "")
    assert ask("open 1 9600", "pause 0.5", "ask 1 E") == "e,0,0"


def test_a_typed_command_comes_before_the_answer(session: Session) -> None:
    ask = begun(session)
    session.evaluate(1, "x = 'a\\b'\ny = 2")
    session.evaluate(1, "z = 3")
    assert ask.client.next_command() == r"!x = 'a\\b'\ny = 2"
    assert ask.client.next_command() == "!z = 3"
    assert not ask.client.typed
    ask("typed z = 3\\n")
    lines = [line[9:] for line in session.desk.log.since(0)[1]]
    assert lines == [r">> x = 'a\b'", "y = 2", ">> z = 3", "z = 3", ""]
    for number, command, rule in ((2, "x", "must be for a program that takes part"), (1, "", "1 to 10000 characters")):
        with pytest.raises(ParameterError, match=rule):
            session.evaluate(number, command)


def test_a_program_replaces_only_its_own_last_line(session: Session) -> None:
    ask = begun(session)
    other = Asker(session, 2)
    log = session.desk.log

    def lines() -> list[str]:
        return [line[9:] for line in log.since(0)[1]]

    ask("print_over 0 of 9", "print 1 of 9", "print_over 2 of 9", "print_over 3 of 9")
    assert lines() == ["0 of 9", "3 of 9"]
    other("print hello")
    ask("print_over 4 of 9", "print_over 5 of 9")
    assert lines()[-3:] == ["3 of 9", "hello", "5 of 9"]


def test_polls_let_no_time_pass(session: Session) -> None:
    ask = begun(session, "thinking live")
    ask("open 1 9600", "ask 1 N")
    before_ns = session.world.now_ns
    with session.world.lock:
        ask(*["poll"] * 100)
        assert session.world.now_ns == before_ns


def test_a_program_is_not_disturbed_by_people_who_look_back(session: Session, tmp_path: Path) -> None:
    """It takes and restores checkpoints of the present, and saves the present world."""
    ask = begun(session)
    session.desk.looking.start_history()
    ask("open 1 9600", "ask 1 D,5,5", "checkpoint", "pause 3")
    here = ask("pose 1")
    ask("close 1")
    asyncio.run(session.desk.looking.look_at(0))
    ask(f"save {tmp_path / 'now.kiks'}", "reset")
    assert session.desk.past is not None
    asyncio.run(session.desk.looking.back_to_now())
    assert ask("pose 1") != here
    ask(f"world file {tmp_path / 'now.kiks'}")
    assert ask.numbers("pose 1")[:2] == pytest.approx([float(word) for word in here.split()][:2], abs=0.1)


def test_a_recording_on_a_full_disk_ends_alone(
    ask: Asker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("kiks.recording.recorder.CHUNK_S", 0.0)
    for name in ("run", "other"):
        ask(f"record {tmp_path / name}.mcap")
        with monkeypatch.context() as full:
            full.setattr("kiks.recording.mcap_file.disk_space", lambda _folder: DiskSpace(0, 1))
            ask("pause 2")
        assert "almost full" in caplog.messages[-1]
        assert ask("ask 1 B").startswith("b,")
        if name == "run":
            assert "almost full" in ask.refused("record")
    ask("world default")
    assert Recording(tmp_path / "run.mcap").is_whole
