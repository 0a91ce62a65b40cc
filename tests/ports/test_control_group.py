"""Control groups: where this user may make one, the kernel holds its limits for all processes together."""

import subprocess
import sys
from collections.abc import Iterator

import pytest
from tests.guard import GUARD_S

from kiks.ports.control_group import ControlGroup

THREADS = """
import threading
count, is_over = 0, threading.Event()
try:
    while count < 100:
        threading.Thread(target=is_over.wait).start()
        count += 1
except RuntimeError:
    pass
print(count)
is_over.set()
"""


@pytest.fixture
def group() -> Iterator[ControlGroup]:
    made = ControlGroup(processes=20, memory=50_000_000)
    if not made.folders:
        pytest.skip("this user can make no control group here")
    yield made
    made.close()
    assert not any(folder.exists() for folder in made.folders)


def run(group: ControlGroup, code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(group.line([sys.executable, "-c", code]), capture_output=True, text=True, timeout=GUARD_S)


def test_there_are_no_more_processes_and_threads_than_a_group_may_have(group: ControlGroup) -> None:
    assert run(group, THREADS).stdout == "19\n"


def test_who_takes_more_memory_is_ended(group: ControlGroup) -> None:
    assert run(group, "print(len(bytes(1_000_000)))").stdout == "1000000\n"
    assert not group.is_out_of_memory
    assert run(group, "bytearray(80_000_000)").returncode == -9
    assert group.is_out_of_memory


def test_a_line_without_a_group_stays_as_it_is() -> None:
    group = ControlGroup(1, 1)
    group.close()
    group.folders.clear()
    assert group.line(["true"]) == ["true"]
