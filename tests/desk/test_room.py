"""A room: students come in by code and name, and nothing of one reaches another."""

import asyncio
import json
import re
import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.parse import urlencode
from zipfile import ZipFile

import pytest
import socketio
from nicegui import Client as Page
from tests.desk.clients import OWNER, Client
from tests.guard import GUARD_S, wait_until
from tests.namespaces import needs_sandbox
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from kiks.desk.room import entrance
from kiks.desk.room.entrance import Guesses, check_code
from kiks.desk.room.names import folder_name, read_names
from kiks.desk.room.page import open_room
from kiks.desk.room.room import Room
from kiks.desk.server import fair_share, tries
from kiks.desk.server.access import KEY, STRANGERS_MAX
from kiks.desk.server.desk import Desk
from kiks.desk.server.rights import Rights
from kiks.desk.server.server import SERVER
from kiks.desk.server.token import COOKIE, Token
from kiks.desk.server.turns import Share, Turns
from kiks.errors import KiksError, ParameterError
from kiks.model.arena import Arena
from kiks.model.exercise import Cases, Exercise
from kiks.model.goal import Goal
from kiks.model.project import Project, ProjectRobot
from kiks.ports.program_command import ProgramCommand
from kiks.trials.hand_in import SCORE, has_run
from kiks.trials.submissions import submissions_in

NAMES = ["Ada", "Bob", "../etc", "<b>Eve</b>"]
CODE = "KX7Q2M"


class Browser(Client):
    """A browser of a student."""

    def enter(self, name: str, code: str = CODE) -> int:
        """Choose a name, and keep the cookie; return the status."""
        status, headers, page = self.ask("/", "POST", urlencode({"code": code, "name": name}))
        if (found := re.search(f"{COOKIE}=[^;]+", headers)) is not None:
            self.cookie = found[0]
            self.home = json.loads(re.search("const home = (.*);", page)[1])
        return status


def entered(*names: str) -> list[Browser]:
    """Return browsers of students who have chosen these names."""
    browsers = [Browser() for _ in names]
    assert [browser.enter(name) for browser, name in zip(browsers, names, strict=True)] == [200] * len(names)
    return browsers


def page_number(client: Client, path: str) -> str:
    """Open a page of NiceGUI; return the number that it has."""
    known = set(Page.instances)
    assert client.page(path)[0] == 200
    return (set(Page.instances) - known).pop()


def exercise() -> Project:
    cases = Cases("home", seed=(1, 2)), Cases("secret", seed=(3,), is_hidden=True)
    goal = Goal("Drive 5 cm", solved="path_mm > 50", points="7 * is_solved")
    return Project(Arena.box(400, 400), robots=(ProjectRobot(),), goal=goal, cases=cases, exercise=Exercise("Drive"))


@pytest.fixture
def room(tmp_path: Path) -> Iterator[Room]:
    room = Room(exercise(), tmp_path, NAMES, tmp_path / "room", code=CODE, is_trusted=True)
    with open_room(room, port=0):
        yield room


def assert_ends(feed: ClientConnection) -> None:
    with pytest.raises(ConnectionClosed):
        assert [feed.recv(timeout=GUARD_S) for _ in range(1000)] == []


def test_a_student_comes_in_by_code_and_name(room: Room) -> None:
    browser = Browser()
    assert browser.ask("/?code=AAAAAA")[0] == 403
    for path, shows_names in (("/", False), ("/?code=kx7-q2m", True)):
        status, _, page = browser.ask(path)
        assert (status, "Ada" in page, "<b>" in page) == (200, shows_names, False)
    assert (browser.enter("Ada", "AAAAAA"), browser.enter("Nobody"), browser.cookie) == (403, 409, "")
    assert browser.enter("Ada") == 200
    status, headers, _ = browser.ask(browser.home)
    assert (status, "desk/1" in headers) == (307, True)
    assert browser.page("desk/1")[0] == 200
    with browser.socket("desk/1/feed") as feed:
        assert json.loads(feed.recv(timeout=GUARD_S))["kind"] == "scene"


def test_a_name_is_taken_until_it_is_given_free(room: Room) -> None:
    (first,), second = entered("Ada"), Browser()
    assert (second.enter("Ada"), second.cookie) == (409, "")
    (room.desks["Ada"].desk.folder / "mine.py").write_text("print(1)")
    with first.socket("desk/1/feed") as feed:
        feed.recv(timeout=GUARD_S)
        SERVER.run(room.give_free("Ada"))
        assert_ends(feed)
    assert first.page("desk/1")[0] == 403
    assert second.enter("Ada") == 200
    assert (second.page("desk/1")[0], first.page("desk/1")[0]) == (200, 403)
    assert (room.desks["Ada"].desk.folder / "mine.py").exists()


def test_a_student_reaches_nothing_of_another(room: Room) -> None:
    ada, bob = entered("Ada", "Bob")
    for path in (
        *("desk/2", "desk/2/feed", "desk/2/arena/1.png", "desk/02", "desk/1/../2", "desk/1/%2e%2e/2", "desk//2"),
        *("room", "room/picture/1", "room/", "/room", "./room", "room?token=x", "desk/1/../../room", "openapi.json"),
    ):
        assert ada.page(path)[0] in (403, 404), path
    # With the path of another one, and one's own cookie; and the other way round.
    for mixed in (Browser(ada.cookie, bob.home), Browser(bob.cookie, ada.home), Browser("", ada.home)):
        assert mixed.page("desk/1")[0] == mixed.page("desk/2")[0] == mixed.page("room")[0] == 403
        for number in (1, 2):
            with pytest.raises(InvalidStatus), mixed.socket(f"desk/{number}/feed"):
                pass
    with pytest.raises(InvalidStatus), ada.socket("desk/2/feed"):
        pass
    assert Browser(ada.cookie, OWNER.home).page("room")[0] == 403
    assert Browser(f"{COOKIE}={SERVER.key.token}", ada.home).page("desk/1")[0] == 403
    assert ada.ask("/room?token=" + ada.cookie.partition("=")[2])[0] == 403
    assert OWNER.page("desk/2")[0] == OWNER.page("room")[0] == 200
    assert OWNER.ask(f"{OWNER.home}room/picture/1")[2].startswith("\ufffd\ufffd")


def test_messages_reach_pages_of_the_same_token_alone(room: Room) -> None:
    ada, bob = entered("Ada", "Bob")
    own, other, lecturers = (page_number(*each) for each in ((ada, "desk/1"), (bob, "desk/2"), (OWNER, "room")))
    heard: list[Any] = []
    for page in (other, lecturers):
        for name in ("handle_event", "handle_javascript_response", "handle_log_message"):
            setattr(Page.instances[page], name, lambda message, name=name: heard.append(name))
    Page.instances[own].handle_event = lambda message: heard.append("own")

    async def attack() -> list[Any]:
        answers = []
        async with socketio.AsyncSimpleClient() as socket:
            url = f"{SERVER.address()}?client_id={own}&implicit_handshake=false"
            path = f"{ada.home}_nicegui_ws/socket.io"
            await socket.connect(url, headers={"Cookie": ada.cookie}, socketio_path=path, transports=["websocket"])
            for page in (other, lecturers, own):
                hand = {"client_id": page, "tab_id": "t", "document_id": "d", "next_message_id": 0, "old_tab_id": None}
                answers.append(await socket.call("handshake", hand))
                for event in ("event", "javascript_response", "log", "ack"):
                    message = {"client_id": page, "id": 1, "level": "error", "message": "x", "next_message_id": 9}
                    await socket.emit(event, message)
            for page in ([], {}, None, {"client_id": []}, {"client_id": 7}):
                await socket.emit("event", page)
            answers.append(await socket.call("handshake", hand))
        for page in (other, lecturers):
            refused = socketio.AsyncSimpleClient()
            query = f"client_id={page}&implicit_handshake=true&tab_id=t&document_id=d&next_message_id=0"
            url = f"{SERVER.address()}?{query}"
            with pytest.raises(socketio.exceptions.ConnectionError):
                await refused.connect(url, headers={"Cookie": ada.cookie}, socketio_path=path)
        return answers

    assert asyncio.run(attack())[:3] == [False, False, True]
    assert set(heard) <= {"own"}
    assert Page.instances[other].tab_id is None
    upload = f"{ada.home}_nicegui/client/{other}/upload/5"
    assert ada.ask(upload, "POST", "x", content_length="1")[0] == 404


def test_a_student_who_asks_too_much_is_refused_and_a_guesser_shuts_nobody_out(
    room: Room, monkeypatch: pytest.MonkeyPatch
) -> None:
    ada, bob = entered("Ada", "Bob")
    answers = [ada.page("desk/1/unknown")[0] for _ in range(40)]
    assert (answers[:15], answers[-1]) == ([404] * 15, 429)
    assert bob.page("desk/2")[0] == OWNER.page("desk/1")[0] == 200
    pauses = []

    async def sleep(pause_s: float) -> None:
        pauses.append(pause_s)

    monkeypatch.setattr(entrance, "asyncio", SimpleNamespace(sleep=sleep))
    wrong = ["AAAAA" + letter for letter in "BCDEFGHIJKLMNOPQRSTUVWXYZ"]
    assert {Browser().ask("/?code=" + code)[0] for code in wrong} == {403}
    assert Browser().enter("../etc") == 200
    assert len(pauses) >= 2
    assert max(pauses) <= entrance.PAUSE_MAX_S


def test_a_browser_that_goes_on_asking_too_much_is_served_at_its_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    now, served = [0.0], []
    monkeypatch.setattr(fair_share, "Bucket", partial(fair_share.Bucket, wall_s=lambda: now[0]))

    async def page(*_: object) -> None:
        served.append(now[0])

    async def refuse(message: object) -> None:
        pass

    async def ask() -> None:
        key, share = Token(desk=1), fair_share.FairShare(page)
        for second in range(10):
            now[0] = float(second)
            for _ in range(100):
                await share({KEY: key, "type": "http", "root_path": "", "path": "/desk/1"}, refuse, refuse)

    asyncio.run(ask())
    (at_once, per_s), cost = fair_share.REQUESTS, fair_share.PAGE_COST
    assert [served.count(second) for second in range(10)] == [at_once / cost, *[per_s / cost] * 9]


def test_wrong_codes_are_few() -> None:
    """All that strangers can do is to wait with each of their connections before each of their codes."""
    now = [0.0]
    guesses, borne = Guesses(wall_s=lambda: now[0]), 0
    while now[0] < 600:
        address = f"192.0.2.{borne % 200}"
        pause_s = guesses.pause_s(address)
        for _ in range(STRANGERS_MAX):
            guesses.note_wrong(address)
            borne += 1
        now[0] += pause_s
    assert borne <= 400 + 600 / entrance.PAUSE_MAX_S * STRANGERS_MAX


def test_a_wrong_file_of_names_gets_one_line(tmp_path: Path) -> None:
    file = tmp_path / "names.txt"
    for text, words in (
        (b"Ada\nBob\n ada \n", "each name once, but 'ada' stands on lines 1 and 3"),
        (b"\n\n \n", "1 to 200 names"),
        (b"".join(b"%d\n" % number for number in range(10_000)), "200 names, one on each line, but it has 10000"),
        (b"Ada\n" + b"x" * 61, "60 printable characters, but line 2"),
        ("Ada\nB\u202eob\n".encode(), "60 printable characters, but line 2"),
        (b"Ada\nB\x1b[31mob\n", "60 printable characters"),
        (b"x" * 2_000_000, "at most 1 MiB"),
        (b"A\xffda", "text in UTF-8"),
    ):
        file.write_bytes(text)
        with pytest.raises(ParameterError, match=re.escape(words)) as raised:
            read_names(file)
        assert "\n" not in str(raised.value)


def test_names_become_folders_that_differ_and_lead_nowhere(tmp_path: Path) -> None:
    file = tmp_path / "names.txt"
    file.write_text("\ufeffAda\n\n  Jo\u0308rg   M \r\n../../etc\n/root\nCON\n.ssh\n-rf\n\u65e5\u672c\na/b\na_b\n~\n")
    names = read_names(file)
    assert names[:2] == ["Ada", "J\xf6rg M"]
    folders = [folder_name(name) for name in names]
    assert folders[0] == "Ada"
    assert len({each.casefold() for each in folders}) == len(names)
    for each in folders:
        assert (tmp_path / each).resolve().parent == tmp_path
        assert not each.startswith((".", "-", "~"))


def test_what_is_handed_in_lies_in_one_folder(room: Room) -> None:
    entered("Ada", "../etc")
    for name, each in room.desks.items():
        each.desk.hand_in(b"1", "mine.py")
        each.desk.hand_in(name.encode(), "../../evil.zip")
    handed_in = {each.name: each.read_bytes() for each in (room.folder / "handed-in").iterdir()}
    assert handed_in == {"Ada.zip": b"Ada", f"{folder_name('../etc')}.zip": b"../etc"}
    room.set_submissions_open(False)
    desk = room.desks["Ada"].desk
    assert not desk.may_hand_in
    with pytest.raises(ParameterError, match="your teacher has closed it"):
        desk.hand_in(b"2", "mine.py")
    room.set_submissions_open(True)
    for wrong in ("mine", "x.p/y", ".", "a.\u65e5"):
        with pytest.raises(ParameterError, match="must be a file"):
            desk.hand_in(b"2", wrong)


def test_a_room_comes_up_again(tmp_path: Path) -> None:
    ada = Browser()
    for _ in range(2):
        room = Room(exercise(), tmp_path, NAMES[::-1], tmp_path / "room", is_trusted=True)
        with open_room(room, port=0):
            if not ada.cookie:
                assert ada.enter("Ada", room.code) == 200
                room.desks["Ada"].desk.folder.joinpath("mine.py").write_text("print(1)")
                room.seats["Ada"].note(7, is_solved=True)
                room.save()
                code = room.code
            assert (ada.page("desk/1")[0], [*room.desks]) == (200, ["Ada"])
            assert room.desks["Ada"].desk.folder.joinpath("mine.py").read_text() == "print(1)"
            assert Browser().enter("Ada", room.code) == 409
        assert ada.page("desk/1")[0] == 403
    assert (room.code, room.seats["Ada"].is_solved) == (code, True)
    assert (tmp_path / "room" / "room.json").stat().st_mode & 0o77 == 0
    (tmp_path / "room" / "room.json").write_text("{")
    with pytest.raises(ParameterError, match="file of the room"):
        Room(exercise(), tmp_path, NAMES, tmp_path / "room", is_trusted=True)


def test_the_later_of_two_hand_ins_counts_and_is_tried_when_the_room_is_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two pages of a student hand in at the same time, and the room ends before there was a turn."""
    is_over, file = threading.Event(), tmp_path / "room" / "handed-in" / "Ada.zip"
    for is_first in (True, False):
        monkeypatch.setattr(tries, "TRIES", turns := Turns(1))
        room = Room(replace(exercise(), seconds=2.0), tmp_path, NAMES, tmp_path / "room", code=CODE, is_trusted=True)
        with open_room(room, port=0):
            if is_first:
                turns.start(is_over.wait, Share())
                entered("Ada")
                desk = room.desks["Ada"].desk

                async def give(name: str, desk: Desk = desk) -> None:
                    (desk.folder / name).write_text(
                        f"import kiks, time\nkiks.Khepera('COM1').set_speed(9, 9)\ntime.sleep(1)\nprint({name!r})"
                    )
                    await desk.give(ProgramCommand(desk.folder / name), "drive.zip")

                async def give_both() -> None:
                    await asyncio.gather(give("one.py"), give("other.py"))

                SERVER.run(give_both())
                handed_in = submissions_in([file], tmp_path / "copies")
                assert not has_run(file)
            else:
                wait_until(lambda: has_run(file))
        is_over.set()
    (again,) = submissions_in([file], tmp_path / "copies")
    assert again.files == handed_in[0].files
    with ZipFile(file) as archive:
        assert json.loads(archive.read(SCORE))["solved"] == 2


def test_a_desk_stays_with_the_exercise_without_hidden_cases_and_has_a_highest_speed(room: Room) -> None:
    """A project of a student's own could have a supervisor, which would run in the server's process."""
    entered("Ada")
    desk = room.desks["Ada"].desk
    (desk.folder / "evil.py").write_text("def supervise(sim):\n    yield 1\n")
    project = replace(exercise(), supervisor="evil.py")
    with pytest.raises(ParameterError, match="must stay with its exercise"):
        SERVER.run(desk.replace(project, desk.folder))
    assert desk.project == room.project
    assert not any(case.is_hidden for table in room.project.cases for case in table.each())
    for speed in (None, 2 * Rights.STUDENT.speed_max):
        with pytest.raises(ParameterError, match="as many share this computer"):
            SERVER.run(desk.set_speed(speed))


def test_a_room_without_a_sandbox_does_not_open(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kiks.ports.bubblewrap.shutil.which", lambda name: None)
    with pytest.raises(KiksError, match="must run in a sandbox") as raised:
        Room(exercise(), tmp_path, NAMES, tmp_path / "room")
    assert "--trusted" in str(raised.value)
    assert not (tmp_path / "room").exists()


SPY = """
import sys
from contextlib import suppress
from pathlib import Path

for place in map(Path, sys.argv[1:]):
    for look in (Path.read_bytes, lambda path: list(path.iterdir())):
        with suppress(OSError):
            look(place)
            print("reached", place)
for place in map(Path, sys.argv[1:]):
    with suppress(OSError):
        place.write_text("x")  # it may be a file in the sandbox's own memory
print("done")
"""


@needs_sandbox
def test_a_program_of_a_student_reaches_nothing_of_another(tmp_path: Path) -> None:
    (tmp_path / "names.txt").write_text("Ada")
    room = Room(exercise(), tmp_path, NAMES, tmp_path / "room", code=CODE)
    with open_room(room, port=0):
        entered("Ada", "Bob")
        desk, other = room.desks["Ada"].desk, room.desks["Bob"].desk
        (other.folder / "secret.py").write_text("print(1)")
        (desk.folder / "spy.py").write_text(SPY)
        places = [other.folder, other.folder / "secret.py", room.folder / "room.json", tmp_path / "names.txt"]
        command = ProgramCommand(desk.folder / "spy.py", [*map(str, places), "/etc/passwd"])
        SERVER.run(desk.go_on())
        handle = SERVER.run(desk.change(lambda _: desk.programs.start(command)))
        assert handle.has_ended.wait(GUARD_S)
        assert [each.text for each in handle.output.since(0)[1]] == ["done"]
        assert (other.folder / "secret.py").read_text() == "print(1)"


def test_a_code_of_a_persons_own() -> None:
    assert check_code("ada-2026") == "ADA2026"
    for code in ("", "12345", "a-b-c", "\u65e5\u672c\u65e5\u672c\u65e5\u672c", "x" * 41):
        with pytest.raises(ParameterError, match="--code must have"):
            check_code(code)
