"""Programs on other computers that drive robots of a desk: `kiks host`, `kiks run --join` and `kiks://HOST:PORT/1`."""

import json
import re
import socket
import threading
from collections.abc import Sequence
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from tests import forked
from tests.at_length import cases, share
from tests.desk.test_desk_command import line_with, started, stop
from tests.guard import GUARD_S, wait_until
from tests.matlab.octave import needs_octave
from tests.served import BOX, PROGRAMS, fresh
from websockets.sync.server import ServerConnection, serve

import kiks
from kiks.desk.server.desk import Desk
from kiks.desk.server.players import Players
from kiks.desk.server.rights import Rights
from kiks.desk.server.server import SERVER
from kiks.desk.server.show import Driver, Shown
from kiks.errors import LinkError, ParameterError
from kiks.model.project import Project, ProjectRobot
from kiks.ports import messages
from kiks.ports.joining import PATH, Address, HostedPort, HostSocket
from kiks.ports.messages import Asked, Inbox, MessageError, Verb, packed
from kiks.ports.program_command import ProgramCommand
from kiks.ports.programs import Programs
from kiks.run import Run
from kiks.sim.simulation import Simulation
from kiks.version import __version__

pytestmark = pytest.mark.slow


class Host:
    """A world whose robots programs elsewhere drive."""

    def __init__(self, robots: int = 1, thinking: str = "none") -> None:
        self.sim = fresh(robots)
        self.said: list[str] = []
        numbers = range(1, robots + 1)

        rules = {"players": numbers, "patience_s": GUARD_S, "say": self.said.append}
        run = Run.in_world(self.sim, speed=1.0 if thinking == "live" else None, thinking=thinking, **rules)
        self.desk = Desk(run, Rights.OWNER)
        self.desk.begin()
        self.shown = Shown(self.desk, port=0)
        self.players = Players(self.desk, numbers, self.said.append)
        SERVER.let_in(self.players)
        self.tokens = {robot: key.token for key, robot in self.players.robots.items()}
        self.ends: list[tuple[int, str]] = []
        self.driver = Driver(self.desk, self._end)
        self.driver.start()

    def _end(self, sim: Simulation) -> None:
        self.players.pause()
        self.ends.append((sim.now_ns, sim.state_hash()))

    def close(self) -> None:
        self.driver.stop()
        self.driver.join(GUARD_S)
        self.shown.close()

    def url(self, robot: int = 1, token: str | None = None) -> str:
        return f"kiks://{SERVER.place()}/{robot}?token={self.tokens[robot] if token is None else token}"

    def wait_said(self, text: str) -> None:
        wait_until(lambda: any(text in line for line in self.said))


def at_once(*acts: Any) -> list[Any]:
    """Call functions in threads; return what they return."""
    results: list[Any] = [None] * len(acts)

    def call(index: int) -> None:
        try:
            results[index] = acts[index]()
        except Exception as error:
            results[index] = error

    threads = [threading.Thread(target=call, args=(index,), daemon=True) for index in range(len(acts))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(GUARD_S)
    return results


DRIVE = str(PROGRAMS / "drive.py")


def printed(*words: str, code: str | None = None) -> str:
    """Run `kiks`, or a program; return what it prints."""
    done = forked.run(*words, code=code)
    assert done.returncode == 0, done.stderr
    return done.stdout


def joined(url: str, *words: str, program: str = DRIVE) -> str:
    """Run a program in simulated time; return what it prints."""
    return printed("run", "--join", url, program, "COM1", *words)


def opened(url: str, *words: str) -> str:
    """Run a program that opens the address as a port; return what it prints."""
    return printed(code=f"import sys; sys.argv = {['drive.py', url, *words]}\n{Path(DRIVE).read_text()}")


def run_here(folder: Path, thinking: str, words: Sequence[Sequence[str]], program: str = DRIVE) -> tuple:
    """Run a program in each robot of this computer; return what each prints, and time and state at the end."""
    here, files = fresh(len(words)), [folder / f"{number}.txt" for number in range(len(words))]
    argument_lists = ([str(file), program, "COM1", *each] for file, each in zip(files, words, strict=True))
    commands = [ProgramCommand(PROGRAMS / "into_file.py", each) for each in argument_lists]
    assert Programs(here, commands, thinking=thinking, patience_s=GUARD_S).run() == 0
    return [file.read_text() for file in files], (here.now_ns, here.state_hash())


@pytest.mark.parametrize("thinking", cases(["fixed:2.5", "none"]))
def test_robots_of_a_host_run_as_those_of_kiks_run(thinking: str, tmp_path: Path) -> None:
    words = [("20", "5", "3"), ("15", "-4", "7")]
    with closing(Host(2, thinking)) as host:
        heard = at_once(lambda: joined(host.url(1), *words[0]), lambda: opened(host.url(2), *words[1]))
        there = wait_until(lambda: host.ends)[0]
        assert not host.desk.programs.doubt
    assert (heard, there) == run_here(tmp_path, thinking, words)


OCTAVE = r"""
ref = kopen([-1, 9600, 1]);
for loop = 0:{last}
    ksend(['N' 10], ref);
    ksend(sprintf('D,%d,%d\n', {left}, {right} - mod(loop, 4)), ref);
    reply = ksend(['E' 10], ref);
end
printf('%s\n', reply)
kclose(ref);
printf('%d\n', kiks_mm2p(80))
kiks_siminfo_robotpos
"""

IDENTIFIED = f"""
import sys, serial
port = serial.Serial('COM1', timeout=1)
port.write(b'B\\n')  # as kopen of Octave does
port.readline()
port.close()
exec(open({DRIVE!r}).read())
"""


@needs_octave
def test_octave_and_python_run_together_as_python_alone_under_kiks_run(tmp_path: Path) -> None:
    count = max(2, share(2, 8))
    words = [[str(8 - number), str(3 + number), str(5 - number)] for number in range(count)]
    with closing(Host(count, "fixed:1.5")) as host:

        def octave(number: int) -> tuple[str, str]:
            last, left, right = int(words[number][0]) - 1, words[number][1], words[number][2]
            (file := tmp_path / f"octave{number}.m").write_text(OCTAVE.format(last=last, left=left, right=right))
            done = forked.run("run", "--join", host.url(number + 1), str(file))
            return done.stdout, done.stderr

        def python(number: int) -> str:
            return joined(host.url(number + 1), *words[number], program=str(program))

        (program := tmp_path / "identified.py").write_text(IDENTIFIED)
        acts = [partial(octave if number % 2 else python, number) for number in range(count)]
        done = at_once(*acts)
        assert not [each for each in done if isinstance(each, Exception)], done
        there = wait_until(lambda: host.ends)[0]
    texts, here = run_here(tmp_path, "fixed:1.5", words, str(program))
    assert there == here
    for number, (heard, text) in enumerate(zip(done, texts, strict=True)):
        assert heard[0].splitlines() == [text.splitlines()[-1], "1000"] if number % 2 else heard == text
    assert "this program must have begun the world for that, but the world was there before it" in done[1][1]


# ---- programs that get lost, come back, or do what they may not ----


def link_to(host: Host) -> HostSocket:
    return HostSocket(Address.parse(host.url()))


def test_a_lost_program_leaves_its_robot_standing_and_comes_back() -> None:
    with closing(Host(2)) as host:

        def other() -> tuple[int, int]:
            with kiks.Khepera(host.url(2)) as robot:
                robot.set_speed(2, 2)
                robot.pause(20)
                return robot.encoders()

        def lost() -> str:
            port = HostedPort(host.url(1))
            port.claim("")
            robot = kiks.Khepera(port)
            robot.set_speed(9, 9)
            robot.pause(1)
            robot.encoders()
            # As when the computer of the program loses the network, or when the program is killed.
            port.line._link._host._socket.socket.shutdown(socket.SHUT_RDWR)
            with pytest.raises(LinkError) as error:
                robot.encoders()
            return str(error.value)

        way, why = at_once(other, lost)
        assert min(way) > 3000, "the others go on"
        assert re.fullmatch(r"the host at '\S+' must be there, but has gone: The connection was lost\. Open .*", why)
        host.wait_said("The program of robot 1 was lost. Its robot stands; the program may come back.")
        wait_until(lambda: host.ends)
        assert host.desk.programs.doubt
        with kiks.Khepera(host.url(1)) as back:
            way = back.encoders()
            back.pause(1)
            assert back.encoders() == way
            assert 900 < min(way) < 1500


def test_another_program_takes_the_robot_and_halt_and_a_new_world_end_it() -> None:
    with closing(Host()) as host:
        first = HostedPort(host.url())
        assert first.ask_ns() == 0
        second = kiks.Khepera(host.url())
        second.set_speed(3, 3)
        with pytest.raises(LinkError, match="Another program has taken robot 1 with the same token"):
            first.read(1)
        first.close()
        SERVER.run(host.desk.halt())
        with pytest.raises(LinkError, match="Halt was pressed on the desk of the host"):
            second.encoders()
        third = kiks.Khepera(host.url())
        assert third.encoders() > (0, 0)
        SERVER.run(host.desk.start_over())
        with pytest.raises(LinkError, match="The world has ended"):
            third.encoders()
        with kiks.Khepera(host.url()) as fourth:
            assert fourth.encoders() == (0, 0)
            assert host.desk.sim is not host.sim


def test_a_world_with_live_thinking_waits_for_no_program() -> None:
    with closing(Host(2, "live")) as host:
        silent = HostedPort(host.url(1))
        _, robot = at_once(lambda: silent.claim(""), lambda: kiks.Khepera(host.url(2)))
        robot.set_speed(2, 2)
        robot.pause(1)
        assert robot.encoders() > (100, 100)
        silent.close()
        robot.close()


def test_a_person_begins_without_those_who_have_not_come_and_a_world_without_their_robots_lets_none_in() -> None:
    with closing(Host(3)) as host:
        assert host.desk.is_paused
        with pytest.raises(ParameterError, match="robot 1 must be for programs of this computer"):
            host.desk.programs.start(ProgramCommand(Path(DRIVE)), 1)
        port = HostedPort(host.url(2))
        SERVER.run(host.desk.go_on())
        port.claim("")
        robot = kiks.Khepera(port)
        robot.set_speed(2, 2)
        assert not host.desk.is_paused
        assert host.desk.programs.doubt == "the world did not wait for every program"
        assert host.desk.programs.players == {1: "has not come yet", 2: "drives", 3: "has not come yet"}
        robot.close()
        fewer = replace(host.desk.project, robots=host.desk.project.robots[:1])
        SERVER.run(host.desk.replace(fewer))
        with pytest.raises(LinkError, match="it does not: robot must be "):
            kiks.Khepera(host.url(2))


def hostile(*messages: object) -> bytes:
    return b"".join(each if isinstance(each, bytes) else packed(each) for each in messages)


CLAIM = (Verb.CLAIM, 1, 0, 1, 0, ("me",))
PLACES = "kiks://2", "kiks://127.0.0.1:22/1?token=x", "kiks://127.0.0.1:22/1"
FOREIGN = [(Verb.CLAIM, 2, 0, 1, 0, ("me",)), *((Verb.FIND, 0, 0, 1, 0, (place,)) for place in PLACES)]
BROKEN = {
    "garbage": b"GET / HTTP/1.1\r\n\r\n" * 100,
    "a huge length": b"\xff\xff\xff\xff",
    "marshalled code": hostile((1, 1, 1)),
    "another robot": hostile(CLAIM, (Verb.SEND, 2, 0, 0, 0, (b"D,9,9\n",))),
    "no robot": hostile((Verb.SEND, 0, 0, 0, 0, (b"D,9,9\n",))),
    "a read of another robot": hostile(CLAIM, (Verb.WAIT, 0, 0, 2, 0, (((2, 1, None),), 5))),
    "endless commands": hostile(CLAIM, *[(Verb.SEND, 1, 0, 0, 0, (b"N\n" * 1000,))] * 1000),
    "no answers": hostile(CLAIM, *[(Verb.BAUD, 1, 0, 3, 0, ())] * 200_000),
}


def test_hostile_programs_end_alone() -> None:
    with closing(Host(3, "live")) as host:
        ports = [HostedPort(host.url(robot)) for robot in (1, 2)]
        good, *_ = at_once(lambda: kiks.Khepera(host.url(3)), *(partial(port.claim, "") for port in ports))
        for port in ports:
            port.close()
        good.set_speed(2, 2)
        for request in FOREIGN:
            with closing(link_to(host)) as link:
                link.sendall(hostile(request))
                (answer,) = Inbox(1 << 20).take(link.recv())
                assert answer[4], request
        for name, data in BROKEN.items():
            with closing(link_to(host)) as link:
                with suppress(OSError):
                    for begin in range(0, len(data), 1 << 16):
                        link.sendall(data[begin : begin + (1 << 16)])
                host.wait_said("The program of robot 1 was disconnected: The program ")
                host.said.clear()
                good.pause(0.1)
                assert good.encoders() > (0, 0), name
        with closing(link_to(host)) as slow:
            slow.sendall(b"\x00")
            good.pause(0.1)
        with host.sim.lock:
            assert host.sim.travelled_mm(2) == 0
        good.close()


def test_a_wrong_token_is_refused_and_that_of_a_robot_opens_no_page() -> None:
    with closing(Host()) as host:
        for token in ("", "x", "\xe9", "%0d%0aX:%20y", "a" * 5000, SERVER.key.token):
            with pytest.raises(LinkError, match=r"must (know the token|let the program in|be named as)"):
                kiks.Khepera(host.url(token=token))
        assert not host.desk.programs.are_there
        with pytest.raises(LinkError, match=r"must be that of robot 2, but it is that of robot 1\."):
            kiks.Khepera(host.url(1).replace("/1?", "/2?"))
        for path in (PATH, "/", "/desk/1", f"{SERVER.key.place}/desk/1"):
            request = Request(f"http://{SERVER.place()}{path}", headers={"Authorization": f"Bearer {host.tokens[1]}"})
            with pytest.raises(HTTPError, match="403"):
                urlopen(request, timeout=GUARD_S)


# ---- the commands ----


def test_kiks_host_runs_a_project_with_programs_elsewhere_and_its_own(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(f"import sys\nsys.argv[1:] = ['COM1', '9', '2', '6']\n{Path(DRIVE).read_text()}")
    robots = (ProjectRobot(), ProjectRobot(program="own.py"), ProjectRobot())
    Project(BOX, robots=robots, seed=7, thinking="fixed:1").save(tmp_path / "match.kiks")
    words = ("host", "match.kiks", "--players", "1", "--port", "0", "--no-browser", "--speed", "0")
    with started(*words, folder=tmp_path) as (process, output):
        address = line_with(output, "Robot 1: ").split()[-1]
        line_with(output, "The run begins when")
        assert joined(address, "20", "5", "3").count("\n") == 60
        state = line_with(output, "s simulated, seed 7, state ").split()[-1]
        stop(process)
    done = forked.run("run", str(tmp_path / "match.kiks"), DRIVE, "COM1", "20", "5", "3")
    assert f"state {state}" in done.stderr


def test_wrong_words_are_told() -> None:
    no_places = "kiks://1", "kiks://[::1:8123/1?token=x", "kiks://127.0.0.1:99999/1?token=x"
    for words, message in (
        ("run --join kiks://127.0.0.1:1/1?token=x DRIVE", "must let the program in, but it does not: "),
        *((f"run --join {place} DRIVE", "must be named as kiks host prints it") for place in no_places),
        ("run --join x --seed 3 DRIVE", "--seed must be left out with --join, as the host has the world"),
        ("run --join x DRIVE DRIVE", "--join must have one program, for its address is that of one robot"),
        ("host --thinking replay:x", "thinking must be none, fixed:MS or live for programs elsewhere"),
        ("host --thinking live --patience 3", "--patience must be left out with --thinking live"),
    ):
        done = forked.run(*(DRIVE if word == "DRIVE" else word for word in words.split()))
        assert (done.returncode, done.stderr.count("\n")) == (2, 1)
        assert message in done.stderr
        assert "token=" not in done.stderr or "TOKEN" in done.stderr


def test_a_program_in_simulated_time_opens_no_robot_elsewhere(tmp_path: Path) -> None:
    (program := tmp_path / "opens.py").write_text("import kiks\nkiks.Khepera('kiks://127.0.0.1:1/1?token=secret')\n")
    for words in ((str(program),), (str(program), str(program))):
        done = forked.run("run", *words)
        assert "is on another computer. Run it there: kiks run --join ADDRESS PROGRAM." in done.stderr
        assert "secret" not in done.stderr


WELCOME = {"version": __version__, "robot": 1, "is_late": False, "end_ns": 1 << 63, "thinking": "none"}
WELCOME |= {"offered": ["COM1"], "seed": "0 1", "pulse_mm": 0.08, "addresses": {}}

LIES: list[tuple[list[str | bytes], str]] = [
    ([b"no text"], "both computers must have the same KiKS, but"),
    (["{"], "both computers must have the same KiKS, but"),
    ([json.dumps(WELCOME | {"version": "0.1"})], "has '0.1', and this is"),
    ([json.dumps(WELCOME | {"robot": 0})], "the host at"),
    ([json.dumps(WELCOME | {"thinking": "replay:times.txt"})], "it asks for a file of this computer"),
    ([json.dumps(WELCOME), b"\xff" * 100], "must answer as KiKS does, but it does not"),
    ([json.dumps(WELCOME), packed((1,))], "must answer as KiKS does, but it does not"),
    ([json.dumps(WELCOME), packed((1, -5, None, 0, ""))], "must answer as KiKS does, but it does not"),
    ([json.dumps(WELCOME), packed((1, 9, b"\x1b[31m", 0, ""))], "must answer as KiKS does, but it does not"),
    ([json.dumps(WELCOME), packed((1, 1 << 40, None, 0, "\x1b[31mred\r\n" + "!" * 9999))], " [31mred  !!!"),
    ([json.dumps(WELCOME), packed((7, 9, None, 0, ""))], "must answer as KiKS does, but it does not"),
    ([json.dumps(WELCOME | {"offered": ["\x1b[31m"]})], "offered[0] must be printable, but it was '\\x1b[31m'"),
    (["[" * 99_999], "both computers must have the same KiKS, but"),
    ([json.dumps(WELCOME), "text"], "must be there, but has gone"),
    ([], "must let the program in, but it does not"),
]


def results(kind: int, *given: object) -> tuple[list[bool], messages.Request]:
    """Return which results a program takes that has asked for something at 5 ns, and what it has asked for."""
    request, taken = messages.Request(kind, 1, 5, 1, 0, ARGUMENTS.get(kind, ())), []
    for result in given:
        asked = Asked()
        asked.note(request)
        try:
            asked.answer((1, 9, result, 0, ""))
            taken.append(True)
        except MessageError:
            taken.append(False)
    return taken, request


ARGUMENTS = {Verb.READ: (5, b"\n", 9, 0), Verb.WAIT: (((1, 1, None), (2, 1, None)), 9)}
RESULTS: dict[int, tuple[list[object], list[object]]] = {
    Verb.MEET: ([None], [0, "", ()]),
    Verb.FIND: ([1, 1000], [0, -1, 1001, True, None, "1"]),
    Verb.COUNT: ([0, 99], [-1, 1 << 40, 0.0]),
    Verb.BAUD: ([9600], [0, 1 << 40, None]),
    Verb.ROOM: ([0, 1 << 40], [1 << 80, None]),
    Verb.WAIT: ([(True, False)], [(), (1, 0), (True,), 5]),
    Verb.READ: (
        [(b"b\t\xe9\r\n", 7), (b"12345", -1)],
        # Too early to be in vain, too long, no characters of a robot, and no read.
        [(b"", 7), (b"1234", 7), (b"123456\n", 7), (b"\x1b[1\n", 7), (b"\x9b\n", 7), ("text\n", 7), (b"\n",), None],
    ),
}


@pytest.mark.parametrize("kind", RESULTS)
def test_an_answer_of_a_host_has_a_result_of_its_kind(kind: int) -> None:
    right, wrong = RESULTS[kind]
    taken, request = results(kind, *right, *wrong)
    assert taken == [True] * len(right) + [False] * len(wrong)
    for fields in ((1, 4, right[0], 0, ""), (1, 9, right[0], -1, ""), (2, 9, right[0], 0, "")):
        asked = Asked()
        asked.note(request)
        with pytest.raises(MessageError):
            asked.answer(fields)


def test_a_program_that_speaks_binary_takes_any_byte_of_a_host() -> None:
    asked = Asked()
    for ticket, sent in enumerate((b"R\n", b"\xb2\x00")):
        asked.note(messages.Request(Verb.SEND, 1, 5, 0, 0, (sent,)))
        asked.note(messages.Request(Verb.READ, 1, 5, ticket, 0, (3, None, 9, 0)))
        if not ticket:
            assert asked.answer((0, 9, (b"\f\ar", 7), 0, "")).result[0] == b"\f\ar"
    assert asked.answer((1, 9, (b"\x1b\x00\x9b", 7), 0, "")).result[0] == b"\x1b\x00\x9b"


def test_another_world_of_a_host_keeps_the_thinking_time_that_programs_elsewhere_were_told(tmp_path: Path) -> None:
    run = Run(Project(), tmp_path, thinking="none", players=range(1, 2))
    changed = replace(run.project, thinking="replay:times.txt")
    assert run.again(changed, tmp_path, (), None).thinking == "none"
    free = Run(Project(), tmp_path).again(replace(changed, thinking="fixed:3"), tmp_path, (), None)
    assert free.thinking == "fixed:3"


def test_a_host_is_not_trusted_either() -> None:
    lie: list[str | bytes] = []

    def attend(web: ServerConnection) -> None:
        answers = [*lie]
        for answer in answers:
            web.send(answer)
        if len(answers) > 1:
            web.recv(GUARD_S)

    with serve(attend, "127.0.0.1", 0) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        place = f"127.0.0.1:{server.socket.getsockname()[1]}"
        for lie[:], message in LIES:
            with pytest.raises(LinkError, match=re.escape(message)):
                kiks.Khepera(f"kiks://{place}/1?token=x")
            if lie[1:] and "gone" not in message:
                done = forked.run("run", "--join", f"kiks://{place}/1?token=x", DRIVE, "COM1", "9", "5", "5")
                said = [line for line in done.stderr.splitlines() if "thinking none." not in line]
                assert (done.returncode > 0, len(said), "\x1b" in done.stderr) == (True, 1, False), done.stderr
                assert "must answer as KiKS does, but it does not" in said[0]  # it has answered before it was asked
