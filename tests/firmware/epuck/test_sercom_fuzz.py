"""A million random characters: every reply is one that the protocol allows, and pieces make no difference."""

import random

import pytest
from tests.at_length import share
from tests.firmware.epuck.sercom_grammar import Oracle, first_violation, requests, without_arguments
from tests.firmware.epuck.sercom_line import VERSIONS, SercomLine, sessions, unescaped

from kiks.engine.state import REGISTER_BYTES
from kiks.model.window import SENSOR_HEIGHT, SENSOR_WIDTH

ARGUMENTS = (
    b"0",
    b"1",
    b"-1",
    b"7",
    b"12",
    b"40",
    b"300",
    b"-32769",
    b" 5",
    b"\t6",
    b"+8",
    b"",
    b"x",
    b"9" * 40,
    b"1e3",
)
ENDS = (b"\n", b"\r", b"\r\n", b"\n\n", b"\0\n", b"\n\0", b"\0", b"")


class RestlessLine(SercomLine):
    """Its sensors read something else each time."""

    def __init__(self, version: str) -> None:
        super().__init__(version)
        self.chance = random.Random(version)
        self.most = {"accelerometer": (-1500, 1500), "ground": (0, 1000), "positions": (-(2**40), 2**40)}

    def sense(self, name: str) -> list[int]:
        low, high = self.most.get(name, (0, 4095))
        begin = self.chance.randint(low, high)
        return [low + (begin + 997 * each) % (high - low) for each in range(len(self.readings[name]))]


def some_characters(version: str, chance: random.Random, count: int) -> bytes:
    """Return as many characters: noise, lines and requests, whole, mutilated and endless."""
    letters = [*without_arguments(version), b"I", b"J", b"J", b"b", b"e", b"!"]
    counts = {code: count for code, (count, _) in requests(version).items()}
    codes = [bytes((code,)) for code in counts]
    data = bytearray()
    while len(data) < count:
        what = chance.random()
        if what < 0.25:
            data += chance.randbytes(chance.choice((1, 5, 60)))
        elif what < 0.65:
            words = [chance.choice(letters), *chance.choices(ARGUMENTS, k=chance.randint(0, 7))]
            data += b",".join(words) + chance.choice(ENDS)
        else:
            for code in chance.choices(codes, k=chance.choice((1, 1, 3, 9))):
                data += code + chance.randbytes(counts[code[0]])[chance.random() < 0.05 :]
            data += b"\0" * (chance.random() < 0.9)
        if chance.random() < 0.002:
            data += bytes((chance.choice((65, 0xB2, 0xBC, 0xB7)),)) * 1000 + chance.choice((b"\0\n", b"\n\0"))
    return bytes(data[:count])


def in_pieces(data: bytes, chance: random.Random) -> list[bytes]:
    pieces, place = [], 0
    while place < len(data):
        size = chance.choice((1, 1, 2, 3, 10, 64, 1000))
        pieces.append(data[place : place + size])
        place += size
    return pieces


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_a_million_characters(version: str) -> None:
    met: dict[object, int] = {}
    for seed in range(share(4, 40)):
        chance = random.Random(f"{version} {seed}")
        make = some_characters if seed % 4 else lambda _, chance, count: chance.randbytes(count)
        data = make(version, chance, 50_000)
        output = RestlessLine(version).send(data)
        oracle = Oracle(version, met)
        assert first_violation(version, data, output, oracle) is None, f"seed {seed}"
        line, answers = RestlessLine(version), []
        for piece in in_pieces(data, chance):
            answers.append(line.send(piece))
            assert len(line.robot.receiver.partial) <= 257
        assert b"".join(answers) == output
    # Each letter and each byte has had its turn.
    wanted = {*without_arguments(version), *requests(version), b"I", b"J", "unknown"}
    assert not {each for each in wanted if met.get(each, 0) < 3}


@pytest.mark.slow
@pytest.mark.parametrize("version", VERSIONS)
def test_a_new_receiver_goes_on_from_what_another_remembers(version: str) -> None:
    chance = random.Random(version)
    data = some_characters(version, chance, 20_000)
    whole, receiver = (RestlessLine(version).robot.receiver for _ in range(2))
    for piece in in_pieces(data, chance):
        assert receiver.feed(piece) == whole.feed(piece)
        if chance.random() < 0.3:
            partial = receiver.partial
            assert partial == whole.partial
            # What ends it leaves the robot waiting for any command.
            receiver.feed(receiver.closing())
            assert receiver.feed(b"E\n") == [(1, b"E")]
            receiver.partial = partial
            assert receiver.partial == partial


@pytest.mark.parametrize("version", VERSIONS)
def test_no_command_is_too_strange(version: str) -> None:
    line, chance = RestlessLine(version), random.Random(version)
    for _ in range(share(1000, 10_000)):
        command = chance.randbytes(chance.choice((0, 1, 3, 300)))
        assert isinstance(line.robot.execute(command, 0), bytes)
        assert line.robot.busy_ns(command) >= 0


@pytest.mark.parametrize("version", VERSIONS)
def test_no_memory_is_too_strange(version: str) -> None:
    """A saved state from elsewhere may hold anything."""
    line, chance = SercomLine(version), random.Random(version)
    commands = [bytes([letter]) + rest for letter in range(256) for rest in (b"", b",2", bytes(40))]
    for _ in range(share(3, 30)):
        for command in commands:
            line.robot.view.registers[:] = list(chance.randbytes(REGISTER_BYTES))
            line.robot.view.speed_setpoint[:] = chance.randrange(-(2**31), 2**31)
            assert len(line.robot.execute(command, 0)) <= 3 + 2 * SENSOR_WIDTH * SENSOR_HEIGHT
            assert isinstance(line.robot.wake(0), bytes)


def test_the_oracle_agrees_with_the_transcripts_and_notices() -> None:
    for session in sessions():
        sent = b"".join(unescaped(text) for _, mark, text in session.steps if mark == ">")
        answered = b"".join(unescaped(text) for _, mark, text in session.steps if mark == "<")
        for version in session.versions:
            assert first_violation(version, sent, answered) is None, session.name
    for version, sent, answered in (
        ("AS12", b"E\n", b"e,0\r\n"),
        ("AS12", b"E\n", b"e,0,0\n"),
        ("AS12", b"E\n", b""),
        ("AS12", b"E\n", b"e,0,0\r\n\r\n"),
        ("AS12", b"N\n", b"n,0,0,0,0,0,0,0,-1\r\n"),
        ("AS12", b"M\n", b"m,0,0,0\r\n"),
        ("BT20", b"M\n", b"m,0,0,0,0,0\r\n"),
        ("BT20", b"b\n", b"b,2560 (100%)\r\n"),
        ("AS12", b"I\n", b"i,1,40,40,8,3201\r\n"),
        ("AS12", b"X,1\n", b"x,1\r\n"),
        ("AS12", b"\xb2\0", bytes(15)),
        ("AS12", b"\xb2\0", bytes(17)),
        ("AS12", b"\xb2", bytes(16)),
        ("AS12", b"\xb0\xb2\xb2\xb2\xb2\0", bytes(64)),
        ("BT11", b"\xb0\xb2\xb2\xb2\xb2\0", b""),
        ("AS20", b"\xb3\0", bytes(10)),
        ("AS12", b"\xb7\0", bytes(3202)),
    ):
        assert first_violation(version, sent, answered), (version, sent, answered)
