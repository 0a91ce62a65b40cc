"""The same run again: twice in one process, in another process, and for another processor."""

from __future__ import annotations

import os
import subprocess
import sys

from kiks.model.arena import Arena
from kiks.sim.simulation import Simulation

SCRIPT = (b"D,60,57\n", b"P,-255,200\n", b"D,-5,90\n", b"G,0,0\n", b"C,3000,-2000\n", b"D,127,127\n", b"C,-900,-900\n")


def run_hash() -> str:
    sim = Simulation(Arena.box(400, 300, rounded_mm=60), seed=5, robots=2)
    for number, command in enumerate(SCRIPT * 3):
        sim.port(1 + number % 2).write(command)
        sim.run(1.7)
    assert sim.contacts(1) > 3
    assert sim.contacts(2) > 3
    return sim.state_hash()


def hash_of_process(**environment: str) -> str:
    command = [sys.executable, __file__]
    done = subprocess.run(command, env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_twice_in_one_process():
    assert run_hash() == run_hash()


def test_in_another_process():
    assert hash_of_process() == run_hash()


def test_for_a_processor_without_vectors_and_fused_operations(tmp_path):
    assert hash_of_process(NUMBA_CPU_NAME="generic", NUMBA_CACHE_DIR=str(tmp_path)) == run_hash()


if __name__ == "__main__":
    print(run_hash())
