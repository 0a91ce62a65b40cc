"""The radio: messages between robots, their times, and what happens to those that no program reads."""

from tests.firmware.test_turrets import execute

import kiks
from kiks.firmware.radio import ATTEMPTS, FAILED, PAUSE_FRAMES, READY, RECEIVED, attempt_ns
from kiks.units import character_ns


def a_simulation(radios: tuple[int, ...] = (1, 2), *, robots: int = 3, seed: int = 1) -> kiks.Simulation:
    sim = kiks.Simulation(kiks.Arena.box(600, 600), seed=seed, robots=robots)
    for robot in radios:
        sim.fit(robot, "radio")
    return sim


def send(sim: kiks.Simulation, sender: int, to: int, data: list[int]) -> None:
    numbers = [to, len(data), *data, *[0] * (16 - len(data))]
    assert execute(sim, f"T,4,S,{','.join(map(str, numbers))}", sender) == "t,4,s"


def status(sim: kiks.Simulation, robot: int) -> int:
    return int(execute(sim, "T,4,F", robot).removeprefix("t,4,f,"))


def read(sim: kiks.Simulation, robot: int) -> list[int]:
    return [int(word) for word in execute(sim, "T,4,R", robot).removeprefix("t,4,r,").split(",")]


def run_ns(sim: kiks.Simulation, time_ns: int) -> None:
    sim.advance_to(sim.now_ns + time_ns)


def test_a_message_takes_the_time_of_its_characters() -> None:
    sim = a_simulation()
    for data in ([], [7], list(b"Terribly sorry!"), list(range(240, 256))):
        send(sim, 1, 2, data)
        assert attempt_ns(len(data)) == (10 + len(data)) * character_ns(9600)
        run_ns(sim, attempt_ns(len(data)) - 1)
        assert (status(sim, 1), status(sim, 2)) == (0, READY)
        run_ns(sim, 1)
        assert (status(sim, 1), status(sim, 2)) == (READY, READY | RECEIVED)
        assert read(sim, 2) == [1, len(data), *data, *[0] * (16 - len(data))]
        assert status(sim, 2) == READY
        assert read(sim, 2) == [0] * 18
    # Bytes beyond the length are not sent, and only eight bits count.
    execute(sim, "T,4,S,2,3,257,-1,3,4,5,6,7,8,9,10,11,12,13,14,15,16")
    sim.run(0.1)
    assert read(sim, 2) == [1, 3, 1, 255, 3, *[0] * 13]


def test_a_message_without_a_receiver_fails_after_its_repeats() -> None:
    sim = a_simulation()  # robot 3 has no radio
    for to in (0, 1, 3, 9, -1, 10**30):
        send(sim, 1, to, [1, 2, 3])
        run_ns(sim, ATTEMPTS * attempt_ns(3) - 1)
        assert status(sim, 1) == 0
        run_ns(sim, (ATTEMPTS - 1) * PAUSE_FRAMES * 5 * character_ns(9600) + 1)
        assert status(sim, 1) == READY | FAILED
        send(sim, 1, 2, [4])
        assert status(sim, 1) == 0
        sim.run(0.1)
        assert status(sim, 1) == READY
        assert read(sim, 2)[:3] == [1, 1, 4]


def test_a_busy_radio_drops_a_second_message_keeps_the_older_one_and_misses_one_while_it_sends() -> None:
    sim = a_simulation((1, 2, 3))
    send(sim, 1, 2, [1])
    send(sim, 1, 2, [2])
    sim.run(0.5)
    assert (read(sim, 2)[:3], read(sim, 2)[0]) == ([1, 1, 1], 0)
    send(sim, 1, 2, [1])
    sim.run(0.1)
    send(sim, 3, 2, [3])
    sim.run(0.8)
    assert status(sim, 3) == READY | FAILED, "the sender learns it"
    assert (read(sim, 2)[:3], read(sim, 2)[0]) == ([1, 1, 1], 0)
    # A program that reads in time gets the message that is being repeated.
    send(sim, 1, 2, [1])
    sim.run(0.1)
    send(sim, 3, 2, [3])
    sim.run(0.02)
    assert read(sim, 2)[:3] == [1, 1, 1]
    sim.run(0.3)
    assert read(sim, 2)[:3] == [3, 1, 3]
    assert status(sim, 3) == READY
    sim = a_simulation((1, 2, 3))
    send(sim, 2, 3, [9])
    run_ns(sim, attempt_ns(1) // 2)
    send(sim, 1, 2, [1])
    run_ns(sim, attempt_ns(1))
    assert (status(sim, 1), status(sim, 2)) == (0, READY)
    sim.run(0.3)
    assert read(sim, 2)[:3] == [1, 1, 1]


def test_a_sending_radio_does_not_receive_and_both_messages_arrive_in_the_end() -> None:
    arrivals = 0
    for seed in range(10):
        sim = a_simulation(seed=seed)
        send(sim, 1, 2, [1])
        send(sim, 2, 1, [2])
        run_ns(sim, attempt_ns(1))
        assert not status(sim, 1) & RECEIVED
        assert not status(sim, 2) & RECEIVED
        sim.run(1.0)
        arrivals += bool(status(sim, 1) & RECEIVED) + bool(status(sim, 2) & RECEIVED)
        assert bool(status(sim, 1) & FAILED) != bool(status(sim, 2) & RECEIVED)
    assert arrivals >= 16


def test_it_repeats_to_the_bit_however_often_one_looks() -> None:
    def chat(looks: int) -> tuple[str, list[int], list[int]]:
        sim = a_simulation()
        send(sim, 1, 2, [1, 2])
        send(sim, 2, 1, [3])
        begin_ns = sim.now_ns
        for k in range(1, looks + 1):
            sim.advance_to(begin_ns + 700_000_000 * k // looks)
            sim.state_hash()
        return sim.state_hash(), read(sim, 1), read(sim, 2)

    assert chat(1) == chat(3) == chat(500)


def test_a_message_on_its_way_stands_in_the_state_and_a_restart_forgets_it() -> None:
    sim = a_simulation()
    idle = sim.state_hash()
    send(sim, 1, 2, [5])
    assert sim.state_hash() != idle
    snapshot, now_ns = sim.world.state.snapshot(), sim.now_ns
    sim.run(0.1)
    first = read(sim, 2)
    sim.world.state.restore(snapshot)
    sim.world.now_ns = now_ns
    assert status(sim, 2) == READY
    sim.run(0.1)
    assert read(sim, 2) == first == [1, 1, 5, *[0] * 15]
    send(sim, 1, 2, [5])
    execute(sim, "restart")
    sim.run(0.5)
    assert (status(sim, 1), status(sim, 2)) == (READY, READY)
    send(sim, 1, 2, [5])
    sim.run(0.1)
    execute(sim, "restart", 2)
    assert status(sim, 2) == READY
    assert read(sim, 2) == [0] * 18
