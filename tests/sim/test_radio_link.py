"""A link that is not a cable: programs meet its delay, and the run is the same again."""

import copy
from dataclasses import replace
from pathlib import Path

import pytest
from tests import forked
from tests.cli.test_cli import state_of
from tests.ports.helpers import printed, wheels, write
from tests.ports.test_lockstep import clients
from tests.ports.test_starting_and_stopping import FOR_EVER, driven
from tests.recording.test_recording import check_again, drive, recorded
from tests.served import BOX

from kiks import Arena, Khepera, Simulation
from kiks.cli import app
from kiks.errors import ArenaError, KiksError, ParameterError
from kiks.model.exercise import Case
from kiks.model.project import Project
from kiks.recording.analysis import Lines
from kiks.recording.rerun import run_again
from kiks.sim.from_project import described, in_case, simulation_of
from kiks.sim.wire_log import TimeShares

LATE = "latency_ms=60"

RESENDING = """
import serial, sys
port = serial.Serial("/dev/ttyUSB0", timeout=0.05)
answers = []
for k in range(200):
    port.write(b"N\\n")
    answers.append(port.readline())
    port.write(b"D,%d,5\\n" % (k % 7))
    answers.append(port.readline())
print(sum(answer == b"" for answer in answers) > 5, flush=True)
"""


def world(link: str = "cable", seed: int = 7, robots: int = 1) -> Simulation:
    return Simulation(BOX, robots=robots, seed=seed, link=link)


def test_an_exchange_takes_the_latency_twice() -> None:
    ends_ns = []
    for link in ("cable", LATE):
        sim = world(link)
        Khepera(sim.port(1)).proximity()
        ends_ns.append(sim.now_ns)
    assert ends_ns[1] - ends_ns[0] == 120_000_000


def test_a_cable_is_what_there_was() -> None:
    hashes = set()
    for sim in (world(), world("cable"), world("latency_ms=0"), Simulation(BOX, robots=1, seed=7)):
        drive(sim, 2.0)
        hashes.add((sim.state_hash(), sim.now_ns))
    assert len(hashes) == 1


@pytest.mark.parametrize("link", ["bluetooth", "wifi", "latency_ms=5,jitter_ms=50,loss=0.2"])
def test_the_same_seed_gives_the_same_run(link: str) -> None:
    ends = []
    for seed in (7, 7, 8):
        sim = world(link, seed)
        drive(sim, 3.0)
        ends.append((sim.state_hash(), sim.now_ns))
    assert ends[0] == ends[1] != ends[2]


def test_a_timeout_shorter_than_the_latency_is_over_before_the_reply() -> None:
    sim = world(LATE)
    port = sim.port(1)
    port.timeout = 0.05
    port.write(b"B\n")
    assert (port.readline(), sim.now_ns) == (b"", 50_000_000)
    assert port.in_waiting == 0
    port.timeout = None
    assert port.readline() == b"b,5.02,5.01\r\n"
    # The buffer of the sender is empty once its characters have left, wherever they are.
    port.write(b"N\n")
    assert port.out_waiting == 2
    port.flush()
    assert port.out_waiting == 0
    port.reset_input_buffer()
    assert port.readline().startswith(b"n,")


def test_what_is_on_its_way_acts_after_a_hang_up_and_its_reply_is_lost() -> None:
    sim = world(LATE)
    port = sim.port(1)
    port.write(b"D,5,5\nN\nG,1")
    port.close()
    again = sim.port(1)
    again.write(b"E\n")
    assert sim.now_ns < 60_000_000
    assert again.readline().startswith(b"e,")
    sim.run(1.0)
    assert sim.travelled_mm(1) > 30


def test_the_robot_is_as_late_as_the_link() -> None:
    ways = []
    for link in ("cable", "latency_ms=200"):
        sim = world(link)
        sim.port(1).write(b"D,5,5\n")
        sim.run(1.0)
        ways.append(sim.travelled_mm(1))
    assert ways[0] - ways[1] == pytest.approx(0.2 * 40, abs=0.5)


def test_each_robot_has_a_link_of_its_own_also_a_later_one() -> None:
    sim = world("latency_ms=20,jitter_ms=40", robots=2)
    sim.add_robot()
    ends_ns = []
    for number in (1, 2, 3):
        twin = copy.copy(sim)
        Khepera(twin.port(number)).speed()
        ends_ns.append(twin.now_ns)
    assert min(ends_ns) > 40_000_000
    assert len(set(ends_ns)) == 3


def test_a_copy_has_the_same_link_and_what_is_on_it() -> None:
    sim = world("wifi")
    drive(sim, 0.5)
    sim.port(1).write(b"D,3,3\nN\n")
    twin = copy.deepcopy(sim)
    assert twin.link == "wifi"
    ends = []
    for each in (sim, twin):
        port = each.port(1)
        ends.append((port.readline(), port.readline(), each.now_ns, each.state_hash()))
        drive(each, 1.0)
        ends[-1] += (each.state_hash(),)
    assert ends[0] == ends[1]


def test_a_recording_makes_the_run_again_from_any_time(tmp_path: Path) -> None:
    sim = world("latency_ms=30,jitter_ms=80,loss=0.1")
    recording = recorded(sim, tmp_path / "run.mcap", lambda sim: drive(sim, 6.3))
    check_again(recording, sim.state_hash())
    assert recording.world_at(3.0).link == sim.link


def test_time_in_the_air_is_that_of_the_link(tmp_path: Path) -> None:
    sim = world(LATE)

    def act(sim: Simulation) -> None:
        log = sim.wires[0].watch(sim.now_ns)
        Khepera(sim.port(1)).proximity()
        asked, replied = log.pieces.since(0)[1]
        assert (asked.first_ns, replied.first_ns, replied.last_ns) == (0, asked.acted_ns, sim.now_ns)
        shares.append(log.shares(0, sim.now_ns))

    shares: list[TimeShares] = []
    recording = recorded(sim, tmp_path / "run.mcap", act)
    assert shares[0].waiting_ns == 0
    assert shares[0].link_ns > 120_000_000
    lines = Lines([1])
    for piece in run_again(recording.log):
        lines.add(piece)
    assert lines.shares(recording.log) == shares


def test_projects_and_cases_have_links() -> None:
    project = Project(link="bluetooth")
    assert Project.from_bytes(project.to_bytes()).link == simulation_of(project).link == "bluetooth"
    assert b"link" not in Project().to_bytes()
    tried = in_case(project, Case(link="wifi,latency_ms=60"), Path())
    assert simulation_of(tried).link == "latency_ms=60.0,jitter_ms=13.0,loss=0.002,retry_ms=1500.0"
    assert described(world("wifi")).link == "wifi"
    text = project.to_bytes().replace(b'"bluetooth"', b'"bluetoth5"')
    with pytest.raises(ArenaError, match=r"link must be 'cable'.* but it was 'bluetoth5'\. Did you mean 'bluetooth'"):
        Project.from_bytes(text)
    with pytest.raises(ParameterError, match="Did you mean 'wifi'"):
        replace(project, link="wfi")


def test_a_live_client_waits_for_the_link_in_real_time() -> None:
    with clients(1, thinking="live", sim=world(LATE)) as (run, (client,)):
        client.send(b"B\n")
        run.wait_rounds(3)
        run.later(0.1)
        assert client.has_no_reply()
        run.later(0.1)
        assert client.lines.readline() == b"b,5.02,5.01\r\n"


@pytest.mark.slow
def test_in_lockstep_the_order_in_real_time_does_not_matter() -> None:
    ends = set()
    for order in ((0, 1), (1, 0)):
        with clients(sim=world("wifi", robots=2)) as (run, programs):
            for index in order:
                # Both have sent all before the world goes on, so neither is waited for.
                programs[index].send(b"D,5,5\nN\nD,1,-3\r\nO\n")
                run.wait_rounds(2)
            for index in order:
                assert [programs[index].lines.readline()[:1] for _ in range(4)] == [b"d", b"n", b"d", b"o"]
                programs[index].hang_up()
                run.wait_free(index + 1)
            ends.add((run.sim.now_ns, run.sim.state_hash()))
    assert len(ends) == 1


@pytest.mark.slow
@pytest.mark.parametrize("robots", [1, 2])
def test_programs_that_give_up_early_meet_replies_of_earlier_commands(tmp_path: Path, robots: int) -> None:
    (tmp_path / "resend.py").write_text(RESENDING)
    words = ["run", "--link", "latency_ms=30,jitter_ms=30", *["resend.py"] * robots]
    results = [forked.run(*words[:1], "--seed", str(seed), *words[1:], cwd=tmp_path) for seed in (1, 1, 2)]
    assert {each.returncode for each in results} == {0}, results[0].stderr
    assert all(each.stdout.count("True") == robots for each in results)
    first, same, other = (state_of(each.stderr) for each in results)
    assert first == same != other


@pytest.mark.slow
def test_serve_names_its_ports_by_link_and_the_link_by_radio() -> None:
    with pytest.raises(KiksError, match=r"a name for the serial port, but it was 'wifi'\. Write --radio wifi"):
        app(["serve", "--link", "wifi"], standalone_mode=False)
    with pytest.raises(KiksError, match="Did you mean 'wifi'"):
        app(["serve", "--radio", "wfi"], standalone_mode=False)
    with pytest.raises(KiksError, match="Did you mean 'wifi'"):
        app(["run", "--link", "wfi", "examples/programs/wander.py"], standalone_mode=False)


@pytest.mark.slow
def test_a_robot_stands_still_after_the_stop_has_come_over_a_late_link(tmp_path: Path) -> None:
    sim = world("latency_ms=900")
    with driven(sim) as run:
        handle = run.programs.start(write(tmp_path / "program.py", FOR_EVER.replace("timeout=1", "timeout=3")))
        run.wait_for(lambda: printed(handle) == ["b'd\\r\\n'"])
        with sim.lock:
            run.programs.stop(handle)
        run.wait_for(lambda: not handle.is_running and not run.programs.drive)
        place = sim.pose(1)
        assert wheels(sim) == [0, 0]
        sim.run(1.0)
        assert sim.pose(1) == pytest.approx(place, abs=1e-3)


def test_an_arena_keeps_no_link() -> None:
    assert Project.of_arena(Arena.default()).link == "cable"
