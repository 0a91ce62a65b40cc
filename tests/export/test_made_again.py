"""The engine of pages makes random runs again in node, in a browser and in wasmtime, each checkpoint to the bit."""

import base64
import json
import zlib
from pathlib import Path

import pytest
from tests.at_length import share
from tests.desk.visitor import NewPage, in_each_browser
from tests.export.made_again import in_node, in_page, in_wasmtime
from tests.recording.random_runs import record_random

from kiks.export.page_run import PageRun

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Random runs, as pages hold them."""
    folder = tmp_path_factory.mktemp("runs")
    drawn = [record_random(seed, folder / f"{seed}.mcap") for seed in range(300, 300 + share(4, 20))]
    return [PageRun.of(recording.log).pack() for recording in drawn]


def test_node_makes_runs_again(runs: list[str], tmp_path: Path) -> None:
    assert all(again.is_equal for again in in_node(runs, tmp_path / "node"))


def test_wasmtime_makes_runs_again(runs: list[str]) -> None:
    assert all(in_wasmtime(run).is_equal for run in runs)


@in_each_browser
def test_browsers_make_runs_again(runs: list[str], new_page: NewPage, tmp_path: Path) -> None:
    make_again = in_page(new_page(), tmp_path / "page")
    assert all(make_again(run).is_equal for run in runs)


def test_a_hash_of_another_run_is_noticed(runs: list[str], tmp_path: Path) -> None:
    data = bytearray(zlib.decompress(base64.b64decode(runs[0])))
    end = 4 + int.from_bytes(data[:4], "little")
    moment_count = json.loads(data[4:end])["inputs"]["moment_count"]
    data[end + 8 * moment_count] ^= 1  # of the first hash, behind ticks and meanings of all moments
    forged = base64.b64encode(zlib.compress(data)).decode()
    for again in (*in_node([forged], tmp_path / "node"), in_wasmtime(forged)):
        assert again.equal == again.count - 1
