"""Moves and turns that are calculated by kiks_mm2p go as far as they should, with no wall about."""

from pathlib import Path

import numpy as np
import pytest
from tests.at_length import cases, share
from tests.matlab.octave import needs_octave, run

pytestmark = [needs_octave, pytest.mark.slow]

RESOLUTION_MM = 1.5 * 0.082
"""Half a pulse is lost when kMoveTo rounds, and up to one more is what encoders do not tell [mm]."""

MOVES = """
function moved = move(ref, left_mm, right_mm)
    % Moves, and returns where the robot is as soon as both wheels say that they are on target.
    kiks_siminfo_setrobot(1100, 1100, 0);
    kSetEncoders(ref, 0, 0);
    kMoveTo(ref, kiks_mm2p(left_mm), kiks_mm2p(right_mm));
    status = kGetStatus(ref);
    while status(1) + status(4) < 2
        status = kGetStatus(ref);
    end
    moved = kiks_siminfo_robotpos() - [1100 1100 0];
    kSetSpeed(ref, 0, 0);
    kiks_pause(0.2)
end

kiks(zeros(2200))
ref = kiks_kopen([-1 9600 1]);
mm = {mm};
moves = zeros(2, numel(mm));
for k = 1:numel(mm)
    moves(1, k) = move(ref, mm(k), mm(k))(1);
    moves(2, k) = -move(ref, -mm(k), -mm(k))(1);
end
say('mm', mm)
say('moves', moves)
degrees = {degrees};
turns = zeros(2, numel(degrees));
for k = 1:numel(degrees)
    way = degrees(k) * pi / 180 * 53 / 2;
    turns(1, k) = move(ref, -way, way)(3) * 180 / pi;
    turns(2, k) = -move(ref, way, -way)(3) * 180 / pi;
end
say('degrees', degrees)
say('turns', turns)
kiks_kclose(ref)
"""


@pytest.mark.parametrize("kind", cases(["Khepera", "Khepera_II"]))
def test_moves_and_turns_go_as_far_as_they_should(kind: str, tmp_path: Path) -> None:
    mm, degrees = share(("[10:5:40 100 500]", "45:45:360"), ("[10:40 45:5:100 120:40:1000 1000]", "10:10:360"))
    moves = MOVES.format(mm=mm, degrees=degrees)
    said = run(f"global KIKS_ROBOT\nKIKS_ROBOT = '{kind}';\n{moves}", tmp_path).said
    errors_mm = np.abs(said["moves"] - said["mm"])
    shares = errors_mm / said["mm"]
    turns = (said["turns"] - said["degrees"] + 180) % 360 - 180
    print(f"{kind}: {100 * shares.max():.2f} % and {np.abs(turns).max():.2f} degrees; {(shares > 0.005).sum()} moves")
    assert (errors_mm <= np.maximum(0.005 * said["mm"], RESOLUTION_MM)).all()
    assert (shares > 0.005).sum() < 10, "which are the shortest"
    assert (np.abs(turns) <= 0.5).all()
