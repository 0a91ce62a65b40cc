"""A square test with the formulas of UMBmark: they find a robot's track, and how much its wheels differ."""

import math
from pathlib import Path

import numpy as np
from findings import Finding, command

import kiks
from kiks.export.figures import column_figure
from kiks.fit.umbmark import square_test
from kiks.model.ranges import seeds_in

SIDE_MM, PULSE_MM = 500.0, 0.08
BELIEVED_MM = 53.0  # the track that the program begins with


def drive_square(robot, turn, track_mm=BELIEVED_MM, left=1.0, right=1.0):
    """Drive a square of four sides, to the left (turn = 1) or to the right (-1); a real robot drives it, too.

    `left` and `right` say how large the wheels are, as shares of what their counters are made for.
    """
    robot.set_profile(speed=10)
    robot.set_encoders(0, 0)
    corner_mm = turn * 0.25 * math.pi * track_mm
    left_mm = right_mm = 0.0
    for _ in range(4):
        for forward_mm, round_mm in ((SIDE_MM, 0.0), (0.0, corner_mm)):
            left_mm += forward_mm - round_mm
            right_mm += forward_mm + round_mm
            robot.move_to(left_mm / PULSE_MM / left, right_mm / PULSE_MM / right, wait=True)
            robot.pause(0.5)


def squares(spec, seeds, turn, **belief):
    """Return where a simulated robot ends, as seen from its start, and its first path; a person puts it down."""
    ends, paths = [], []
    for seed in seeds:
        rng = np.random.default_rng([seed, turn + 1])
        sim = kiks.Simulation(kiks.Arena.box(2000, 2000), robot=spec, seed=seed)
        begin = np.array([1000.0, 1000.0]) + rng.normal(0.0, 1.0, 2)
        sim.place(1, *begin, math.radians(rng.normal(0.0, 0.5)))
        sim.record_paths(0.1)
        drive_square(kiks.Khepera(sim.port(1)), turn, **belief)
        paths.append(sim.paths()[0][:, 1:3] - (1000.0, 1000.0))
        ends.append(paths[-1][-1])
    return np.array(ends), paths[0]


def main(
    seeds: str = "1-5",
    out: Path = Path("umbmark.pdf"),
    track: float = 54.0,
    ratio: float = 1.004,
) -> list[Finding]:
    """Let a robot of another track drive squares, with a program that takes its wheels for unequal; correct it."""
    numbers = seeds_in(seeds)
    spec = kiks.RobotSpec.load("khepera").with_changes(body__wheel_base_mm=track)
    # The wheels of a simulated robot are equal. A program that takes the left one for larger meets the same error.
    wrong = {"left": 2 * ratio / (ratio + 1), "right": 2 / (ratio + 1)}
    before = [squares(spec, numbers, turn, **wrong) for turn in (-1, 1)]
    test = square_test(before[0][0], before[1][0], side_mm=SIDE_MM, track_mm=BELIEVED_MM)
    corrected = {"left": wrong["left"] * test.left, "right": wrong["right"] * test.right, "track_mm": test.track_mm}
    after = [squares(spec, numbers, turn, **corrected) for turn in (-1, 1)]
    again = square_test(after[0][0], after[1][0], side_mm=SIDE_MM, track_mm=test.track_mm)

    with column_figure(out, 52, ncols=2) as (paths, clusters):
        for (ends, path), mark, colour in zip(before, "^s", ("C0", "C1")):
            paths.plot(*path.T, color=colour, linewidth=0.8)
            clusters.plot(*ends.T, mark, color=colour, markersize=3, markerfacecolor="none", markeredgewidth=0.6)
        for (ends, _), mark, colour in zip(after, "^s", ("C0", "C1")):
            clusters.plot(*ends.T, mark, color=colour, markersize=3, markeredgewidth=0)
        paths.plot(0, 0, "ok", markersize=2.5)
        paths.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="before, one of each")
        clusters.axhline(0, color="0.8", linewidth=0.5, zorder=0)
        clusters.axvline(0, color="0.8", linewidth=0.5, zorder=0)
        clusters.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title="ends; open: before")
        clusters.set_box_aspect(1)
        clusters.margins(0.15)
        paths.set_box_aspect(1)

    return [
        Finding("alpha [deg]", "", test.alpha_deg, 3),
        Finding("beta [deg]", "", test.beta_deg, 3),
        Finding(f"track found [mm]; it has {track:.2f}, believed {BELIEVED_MM:.2f}", "", test.track_mm),
        Finding(f"right wheel to left one found; in truth {ratio:.4f}", "", test.ratio, 4),
        Finding("farther centre before [mm]", "232 to 423, of a larger robot (secondary)", test.error_mm, 1),
        Finding("farther centre after [mm]", "12 to 35, of the same (secondary)", again.error_mm, 1),
    ]


if __name__ == "__main__":
    command(main)
