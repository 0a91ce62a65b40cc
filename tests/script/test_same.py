"""A program finds Python's own functions and classes, and leaves them as they were."""

import pytest
from tests.script import same
from tests.script.conftest import Run

PROGRAM = """
import datetime, importlib, queue, random, select, socket, threading, time, types
from tests.script import same

def find(path):
    module, _, name = path.rpartition(".")
    return getattr(importlib.import_module(module), name)

for name, each in same.BEFORE.items():
    assert find(name) is each, name
assert same.look() == same.EXPECTED
assert type(datetime.datetime.now()) is datetime.datetime and type(datetime.date.today()) is datetime.date
assert datetime.datetime.now().year == datetime.date.today().year == time.gmtime().tm_year == 2000
assert [type(threading.Lock()), type(threading.RLock()), type(select.poll())] == list(same.KINDS.values())[:3]
assert type(queue.SimpleQueue()) is queue.SimpleQueue and isinstance(time.time, types.BuiltinFunctionType)
ours, theirs = socket.socketpair()
with ours, theirs:
    assert type(ours) is type(theirs) is socket.socket

class Later(datetime.datetime): pass
assert type(Later.now()) is Later and Later.now().year == 2000
class Chance(random.Random): pass
assert 0 <= Chance().random() < 1
print("the same")
"""


def test_no_class_and_no_function_is_replaced(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    before, inside = same.look(), same.inside()
    monkeypatch.setattr(same, "EXPECTED", before, raising=False)
    for _ in range(2):
        ran = run(PROGRAM)
        assert (ran.code, ran.out, ran.err) == (0, "the same\n", "")
        assert (same.look(), same.inside()) == (before, inside)
