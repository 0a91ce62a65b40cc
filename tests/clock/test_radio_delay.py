"""The law of a link that is not a cable: its order, its seed, and how it fits what was measured."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kiks.clock.radio_delay import delay_of
from kiks.clock.serial_timing import TO_HOST, TO_ROBOT, SerialTiming
from kiks.errors import ParameterError
from kiks.model.radio_link import LINKS, RadioLink, parse_link

MS = 1_000_000
FASTEST = 4_000_000


def line_with(link: RadioLink, baud: int = FASTEST, seed: int = 1, robot: int = 0) -> SerialTiming:
    line = SerialTiming(baud)
    line.delay = delay_of(link, seed, robot)
    return line


def intervals_ms(link: RadioLink, count: int, every_ms: int, packets: int) -> np.ndarray:
    """Return the times between packets that a robot sends at a steady pace [ms]."""
    line = line_with(link)
    ends = [line.carry(count, k * every_ms * MS) + count * line.character_ns for k in range(packets)]
    return np.diff(ends) / MS


def test_wifi_is_as_measured_without_images() -> None:
    # epuck2-wifi.md 6: an exchange is the wait for the next packet of 104 bytes, and the robot sends one in 20 ms.
    found = np.percentile(intervals_ms(LINKS["wifi"], 104, 20, 30_000), [5, 25, 50, 75, 90, 95, 99])
    measured = np.array([0.0, 17.6, 21.1, 22.9, 26.5, 30.1, 57.4])
    assert np.abs(found - measured)[[0, 2, 3, 4, 5]].max() < 2.5
    assert abs(found[1] - measured[1]) < 5
    assert abs(found[6] - measured[6]) < 6


def test_wifi_is_as_measured_with_images() -> None:
    # An image goes out 30 ms after its request, and its 38,400 bytes take 100 ms at the speed of this line.
    line, delay = line_with(LINKS["wifi"]), delay_of(LINKS["wifi"], 1, 0)
    assert delay is not None
    count = 104 + 1 + 38_400
    taken = [30 + (delay(TO_HOST, count, k * 137 * MS) + count * line.character_ns) / MS for k in range(20_000)]
    middle, late, latest = np.percentile(taken, [50, 95, 99])
    assert abs(middle - 137) < 8
    assert abs(late - 1518) < 150
    assert abs(latest - 1919) < 350


def test_bluetooth_takes_25_to_40_ms_each_way() -> None:
    delay = delay_of(LINKS["bluetooth"], 1, 0)
    assert delay is not None
    taken = np.array([delay(TO_ROBOT, 2, k) for k in range(20_000)]) / MS
    assert taken.min() >= 25
    assert np.percentile(taken, 95) == pytest.approx(40, abs=1)
    assert np.median(taken) == pytest.approx(26, abs=0.5)


def test_the_share_of_lost_packets_is_that_of_the_link() -> None:
    delay = delay_of(RadioLink(loss=0.1, retry_ms=50), 3, 1)
    assert delay is not None
    for packets in (1, 5):
        times = np.array([delay(TO_HOST, packets * 1460, k) // (50 * MS) for k in range(20_000)])
        assert np.mean(times > 0) == pytest.approx(1 - 0.9**packets, abs=0.01)
        assert np.mean(times > 1) == pytest.approx(0.1 * (1 - 0.9**packets), abs=0.01)


@given(
    st.sampled_from([*LINKS.values(), RadioLink(60.0, 500.0, 0.5, 300.0)]),
    st.lists(st.tuples(st.integers(0, 50 * MS), st.integers(1, 300)), min_size=1, max_size=40),
    st.integers(0, 5),
)
def test_no_piece_overtakes_another_and_no_character_is_early(link: RadioLink, pieces: list, seed: int) -> None:
    line, cable = line_with(link, 9600, seed), SerialTiming(9600)
    at_ns, heard_ns = 0, 0
    for passed_ns, count in pieces:
        at_ns += passed_ns
        start_ns, leaves_ns = line.send(count, at_ns), cable.send(count, at_ns)
        assert start_ns >= max(heard_ns, leaves_ns, at_ns + link.latency_ms * MS)
        heard_ns = start_ns + count * line.character_ns
        # The sender's buffer is the same, wherever the characters are that have left it.
        assert line.room_ns(5) == cable.room_ns(5)


def test_chance_depends_on_seed_robot_direction_and_time_alone() -> None:
    def draws(seed: int, robot: int, direction: int) -> list[int]:
        delay = delay_of(LINKS["wifi"], seed, robot)
        assert delay is not None
        return [delay(direction, 2, at_ns) for at_ns in (5, 3, 10**9)]

    assert draws(1, 0, TO_ROBOT) == draws(1, 0, TO_ROBOT)
    assert len({tuple(draws(seed, robot, way)) for seed in (1, 2) for robot in (0, 1) for way in (0, 1)}) == 8


def test_a_cable_has_no_law() -> None:
    assert delay_of(parse_link("cable"), 1, 0) is None
    assert delay_of(parse_link("retry_ms=50"), 1, 0) is None


def test_links_have_names_numbers_or_both() -> None:
    assert parse_link("wifi") == LINKS["wifi"]
    assert parse_link(" latency_ms = 60, loss=0.01") == RadioLink(60.0, loss=0.01)
    assert parse_link("wifi,latency_ms=60") == RadioLink(60.0, 13.0, 0.002, 1500.0)
    for link in (*LINKS.values(), RadioLink(1 / 3, 2.0, 0.5), RadioLink(retry_ms=5.0)):
        assert parse_link(str(link)) == link
    assert [str(parse_link(name)) for name in LINKS] == list(LINKS)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wfi", "link must be 'cable', 'bluetooth', 'wifi', or numbers such as .* 'wfi'. Did you mean 'wifi'"),
        ("latency=5", "but it was 'latency=5'. Did you mean 'latency_ms'"),
        ("latency_ms", r"but it was 'latency_ms'\.$"),
        ("latency_ms=60 ms", r"but it was 'latency_ms=60 ms'\.$"),
        ("latency_ms=5,wifi", r"but it was 'latency_ms=5,wifi'\.$"),
        ("wifi=1", r"but it was 'wifi=1'\.$"),
        ("", "but it was ''"),
        ("latency_ms=-1", "latency_ms must be at least 0, but it was -1"),
        ("jitter_ms=nan", "jitter_ms must be a finite number"),
        ("loss=2", "loss must be at most 0.9, but it was 2.0. 0.01 is one packet of a hundred"),
        (60, "link must be a text, but it was 60"),
    ],
)
def test_wrong_links_are_refused_in_one_line(text: str, words: str) -> None:
    with pytest.raises(ParameterError, match=words) as found:
        parse_link(text)
    assert "\n" not in str(found.value)
