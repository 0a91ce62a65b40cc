"""What there is to be said of a turret as it stands, in words."""

from __future__ import annotations

from kiks.firmware.battle import Battle
from kiks.firmware.general_io import GeneralIO
from kiks.firmware.gripper import Gripper
from kiks.firmware.k213 import K213
from kiks.firmware.radio import ATTEMPTS, Radio
from kiks.firmware.turret import Turret
from kiks.units import s_from_ns


def describe_turret(turret: Turret) -> str:
    """Return a line about a turret; the simulation's lock is held."""
    return (
        f"{turret.name} (turret {turret.number}): {_state_of(turret)}"
        if turret.number >= 0
        else (f"{turret.name}: {_state_of(turret)}")
    )


def _state_of(turret: Turret) -> str:
    if isinstance(turret, Radio):
        return _radio(turret)
    if isinstance(turret, Battle):
        hits = int(turret.site.record["battle_hits"])
        return f"energy {turret.energy:.1f} of {turret.most:g} points, hit {hits} times since it was asked last"
    if isinstance(turret, Gripper):
        body = turret.site.held_body()
        return "holds nothing" if body is None else f"holds body {body['number']}, or has it between its jaws"
    if isinstance(turret, GeneralIO):
        return f"inputs {turret.inputs:08b}, outputs {turret.outputs:08b}"
    if isinstance(turret, K213):
        return (
            f"a picture every {1000 * s_from_ns(turret.period_ns):g} ms, the last one at "
            f"{s_from_ns(turret.taken_ns):.3f} s, light level {turret.light}"
        )
    return "its own kind"


def _radio(radio: Radio) -> str:
    record = radio.site.record
    parts = []
    if attempt := int(record["radio_attempt"]):
        parts.append(f"sends to robot {record['radio_to']}, attempt {attempt} of {ATTEMPTS}")
    elif record["radio_has_failed"]:
        parts.append(f"its last message, to robot {record['radio_to']}, was lost")
    else:
        parts.append("silent")
    if sender := int(record["radio_from"]):
        data = " ".join(str(byte) for byte in record["radio_from_data"][: int(record["radio_from_length"])].tolist())
        parts.append(f"a message from robot {sender} waits to be read: {data or 'empty'}")
    return "; ".join(parts)
