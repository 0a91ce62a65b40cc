"""Frames to browsers and drags from them, over a real socket."""

import asyncio
import gc
import json
import struct
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from tests.at_length import share
from tests.desk.clients import feed_of
from tests.guard import GUARD_S, wait_until
from websockets.sync.client import ClientConnection

import kiks
from kiks.desk.server.desk import Desk
from kiks.desk.server.gateway import IN_FLIGHT, Gateway, Viewer
from kiks.desk.server.show import Shown, show
from kiks.errors import ParameterError
from kiks.run import Run


@pytest.fixture
def shown() -> Iterator[Shown]:
    sim = kiks.Simulation(kiks.Arena.box(600, 400), robots=2, seed=1)
    sim.place(1, 100, 100, 0)
    sim.place(2, 300, 100, 0)
    sim.add_lamp(50, 350)
    with closing(show(sim, port=0, browser=False)) as shown:
        yield shown


@dataclass
class Browser:
    """A browser without a screen."""

    socket: ClientConnection
    told: dict[str, dict[str, Any]] = field(default_factory=dict)

    def say(self, kind: str, **words: object) -> None:
        self.socket.send(json.dumps({"kind": kind, **words}))

    def hear(self) -> bytes | dict[str, Any]:
        if isinstance(message := self.socket.recv(GUARD_S), bytes):
            return message
        told = json.loads(message)
        self.told[told["kind"]] = told
        return told

    def frame(self) -> bytes:
        """Return the next frame, and acknowledge it."""
        while not isinstance(heard := self.hear(), bytes):
            pass
        self.say("ack")
        return heard

    def error(self) -> str:
        """Return the text of the next error."""
        while not (isinstance(heard := self.hear(), dict) and heard["kind"] == "error"):
            pass
        return str(heard["text"])

    def wait_for(self, fact: Any) -> bytes:
        """Return the first frame that satisfies a condition."""
        while not fact(frame := self.frame()):
            pass
        return frame


@contextmanager
def browsing(shown: Shown) -> Iterator[Browser]:
    with feed_of(shown) as socket:
        yield Browser(socket)


def pose(frame: bytes, robot: int = 0) -> tuple[float, float, float]:
    return struct.unpack_from("<3f", frame, 32 + 128 * robot)


def is_held(frame: bytes) -> bool:
    return bool(struct.unpack_from("<I", frame, 32 + 28)[0] & 8)


def time_s_of(frame: bytes) -> float:
    return struct.unpack_from("<d", frame, 8)[0]


def test_scene_comes_before_its_frames(shown: Shown) -> None:
    with browsing(shown) as browser:
        browser.hear()
        first = browser.told["scene"]["scene"]
        frame = browser.frame()
        assert (struct.unpack_from("<I", frame, 4)[0], pose(frame)) == (first, (100, 100, 0))
        shown.desk.sim.add_ball(500, 300)
        browser.wait_for(lambda frame: struct.unpack_from("<I", frame, 4)[0] > first)
        assert [body["what"] for body in browser.told["scene"]["bodies"]] == ["ball"]


def test_a_browser_without_acknowledgements_gets_three_frames(shown: Shown) -> None:
    with browsing(shown) as sleeper, browsing(shown) as other:
        count = 0
        while count < IN_FLIGHT:
            count += isinstance(sleeper.hear(), bytes)
        for _ in range(10):
            other.frame()
        with pytest.raises(TimeoutError):
            sleeper.socket.recv(0.01)
        sleeper.say("ack")
        assert isinstance(sleeper.hear(), bytes)


def test_a_browser_that_does_not_read_is_disconnected() -> None:
    viewer = Viewer("somebody")
    for _ in range(100):
        viewer.tell({})
    asyncio.run(viewer.send_all(None))


def test_drags_move_things_in_the_engine_also_from_two_browsers_at_once(shown: Shown) -> None:
    with browsing(shown) as one, browsing(shown) as two:
        one.say("grab", what="robot", index=0)
        one.say("move", x_mm=900, y_mm=200)
        frame = one.wait_for(lambda frame: pose(frame)[0] > 200)
        assert shown.desk.sim.pose(1)[:2] == pytest.approx(pose(frame)[:2])
        assert is_held(frame)
        one.say("turn", heading_rad=1.0)
        one.wait_for(lambda frame: pose(frame)[2] == 1.0)
        one.say("drop")
        one.wait_for(lambda frame: not is_held(frame))
        assert shown.desk.shown.hands.are_empty
        one.say("grab", what="robot", index=0)
        one.wait_for(is_held)
        two.say("grab", what="robot", index=0)
        assert "one hand must let go" in two.error()
        two.say("grab", what="robot", index=1)
        two.say("move", x_mm=500, y_mm=300)
        one.say("move", x_mm=100, y_mm=300)
        one.wait_for(lambda frame: pose(frame, 1)[1] == 300 and pose(frame)[1] == 300)
    wait_until(lambda: shown.desk.shown.hands.are_empty)


def test_of_the_moves_of_a_page_only_the_newest_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    sim = kiks.Simulation(kiks.Arena.box(600, 400), seed=1)
    desk = Desk(Run.in_world(sim, speed=None))
    gateway, viewer = Gateway(desk, 1), Viewer("viewer 1")
    moves: list[float] = []
    move = desk.shown.hands.move
    monkeypatch.setattr(desk.shown.hands, "move", lambda owner, x, y: (moves.append(x), move(owner, x, y)))

    async def drag() -> None:
        await gateway._execute(viewer, '{"kind": "grab", "what": "robot", "index": 0}')
        for x_mm in range(100, 300):
            await gateway._execute(viewer, json.dumps({"kind": "move", "x_mm": x_mm, "y_mm": 200}))
        await gateway._execute(viewer, '{"kind": "turn", "heading_rad": 1.0}')
        assert moves == [], "it moves with the next frame, or when it is dropped"
        await gateway._execute(viewer, '{"kind": "drop"}')

    asyncio.run(drag())
    assert (moves, sim.pose(1)) == ([299], pytest.approx((299, 200, 1.0)))
    desk.close()


MALFORMED = [
    *("", "{", "[]", "7", '{"kind": 3}', '{"kind": "fly"}', f'{{"kind": "{"x" * 100_000}"}}', "[" * 100_000),
    *(f'{{"kind": "{kind}"}}' for kind in ("grab", "move", "seek")),
    '{"kind": "grab", "what": "robot"}',
    f'{{"kind": "grab", "what": {"[" * 400}0{"]" * 400}}}',
    *(f'{{"kind": "grab", "what": "robot", "index": {index}}}' for index in ('"0"', "1e400", "-1", "9" * 400)),
    *(f'{{"kind": "move", "x_mm": {x_mm}, "y_mm": 3}}' for x_mm in ("NaN", '{"a": [1]}')),
    *(f'{{"kind": "turn", "heading_rad": {it}}}' for it in ("null", "1e20", "-1e400", "9" * 400, "9" * 9000)),
    *(f'{{"kind": "seek", "time_s": {time_s}}}' for time_s in ('"now"', "NaN", "1e400", "-1e10", "[]")),
]


def test_malformed_messages_get_an_error(shown: Shown) -> None:
    with browsing(shown) as browser:
        browser.say("grab", what="robot", index=0)
        for message in MALFORMED:
            browser.socket.send(message)
            text = browser.error()
            assert "must" in text, message[:99]
            assert len(text) < 400, message[:99]
            browser.say("ack", count=-(10**18))
            browser.say("ack", count=[[]])
            browser.frame()


def test_a_seek_shows_the_past_and_all_browsers_are_told(shown: Shown) -> None:
    sim = shown.desk.sim
    sim.loop.gate.set_speed(None, sim.now_ns) if sim.loop.gate is not None else None
    sim.run(2.0)
    with browsing(shown) as one, browsing(shown) as two:
        for time_s, there_s in ((0.5, 0.5), (99.0, 2.0), (-7, 0.0)):
            one.say("seek", time_s=time_s)
            for browser in (one, two):
                frame = browser.wait_for(lambda frame, there_s=there_s: time_s_of(frame) == there_s)
                assert struct.unpack_from("<H", frame, 2)[0] & 1, "it stands still"
                bar = browser.told["bar"]
                assert (bar["is_past"], bar["begin_s"], bar["end_s"]) == (True, 0.0, 2.0)
        one.say("grab", what="robot", index=0)
        assert "which cannot be changed" in one.error()
    assert (shown.desk.present.sim is sim, sim.now_ns) == (True, 2_000_000_000)


def course(sim: kiks.Simulation) -> str:
    with kiks.Khepera(sim.port(1)) as robot:
        robot.set_speed(6, 3)
        for _ in range(300):
            robot.proximity()
        robot.set_speed(0, 0)
    return sim.state_hash()


@pytest.mark.slow
def test_many_browsers_do_not_change_a_run() -> None:
    alone = course(kiks.Simulation(robots=3, seed=4))
    sim = kiks.Simulation(robots=3, seed=4)
    shown = show(sim, speed=50.0, port=0, browser=False)
    hashes: list[str] = []
    running = threading.Thread(target=lambda: hashes.append(course(sim)))
    running.start()
    try:
        for _ in range(share(15, 50)):
            with browsing(shown) as browser:
                browser.frame()
        shown.desk.gate.set_speed(None, sim.now_ns)
        running.join(GUARD_S)
        assert hashes == [alone]
        with browsing(shown) as browser:
            browser.frame()
            gc.collect()
            # Closed connections are removed; the last one may just be closing.
            assert sum(type(each) is Viewer for each in gc.get_objects()) <= 2
    finally:
        shown.close()
        running.join(GUARD_S)


def test_a_closed_desk_tells_its_browsers_and_releases_its_world() -> None:
    sim = kiks.Simulation()
    shown = show(sim, port=0, browser=False, is_alive=True)
    with browsing(shown) as browser:
        browser.wait_for(lambda frame: time_s_of(frame) > 0.1)
        shown.close()
        while browser.hear() != {"kind": "gone"}:
            pass
    assert sim.loop.gate is None
    now_ns = sim.now_ns
    sim.run(100.0)
    assert sim.now_ns == now_ns + 100_000_000_000


def test_invalid_options_are_refused() -> None:
    for options, words in (
        ({"speed": -1}, "speed must be at least 0.001, but it was -1. 1 is real time"),
        ({"port": -1}, "port must be a whole number from 0 to 65535, but it was -1. Leave it out for a free one"),
        ({"is_alive": "no"}, "is_alive must be True or False, but it was 'no'"),
    ):
        with pytest.raises(ParameterError, match=words):
            kiks.Simulation().show(browser=False, **options)
