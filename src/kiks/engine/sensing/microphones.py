"""The microphones of a robot: the speakers of all robots, its own among them, in a room that is never quite silent.

Model: an amplitude falls with the distance, and a microphone that faces a speaker hears it better than one at the far
side of the body. Walls and things hide no sound. Amplitudes of several speakers, whose waves have nothing to do with
each other, add by their squares. Only the order of the microphones and what a room gives have a source
(epuck2-wifi.md 4, epuck-protocol.md 6.3): right, left and back, and 5 to 20 counts; the other numbers are ours.
"""

from __future__ import annotations

import math
from typing import Any

from kiks.engine.compiling import kernel
from kiks.engine.numbers import sin_cos, uniform
from kiks.engine.sensing.proximity import on_body, pose_at

STREAM_SOUND = 9

COUNTS_MAX = 4095.0
"""The largest reading: twelve bits (epuck-protocol.md 6.3)."""

LOUD_MM = 100.0
"""Distance from a speaker, in the middle of its robot, at which a microphone that faces it reads its `loudness`."""

PLACES_MM = ((0.0, -30.0), (0.0, 30.0), (-30.0, 0.0))
"""How far ahead and to the left each microphone is."""

QUIET, NOISY = 5.0, 20.0
"""What a microphone reads in a room without any speaker, at least and at most."""

SHADOW = 0.25
"""Share of an amplitude that the body takes from a microphone at its far side; half of it at its flanks."""


@kernel
def sense_sound(scene: Any, world: Any, robot: Any, tick_count: Any, time_ns: Any, is_noisy: Any, out: Any) -> Any:
    """Write the amplitudes that the microphones of a robot hear at a time, float64 [3].

    Args:
        scene: The scene (`kiks.engine.scene.open_scene`).
        world: Index of the world.
        robot: Index of the robot.
        tick_count: Ticks done.
        time_ns: Time of the reading [ns].
        is_noisy: False for what is expected, without rounding.
        out: Where they are written.
    """
    state = scene.robots[world, robot]
    x, y, heading = pose_at(state, tick_count, time_ns)
    sine, cosine = sin_cos(heading)
    out[:] = 0.0
    for source in range(scene.robots.shape[1]):
        speaker = scene.robots[world, source]
        if speaker.sound_ends_ns > time_ns and speaker.loudness > 0.0:
            speaker_x, speaker_y, _ = pose_at(speaker, tick_count, time_ns)
            for number in range(out.shape[0]):
                ahead, left = PLACES_MM[number]
                at_x, at_y = on_body(x, y, sine, cosine, ahead, left)
                dx, dy = speaker_x - at_x, speaker_y - at_y
                apart_mm = max(math.sqrt(dx * dx + dy * dy), 1.0)
                facing = ((at_x - x) * dx + (at_y - y) * dy) / (apart_mm * math.sqrt(ahead * ahead + left * left))
                amplitude = speaker.loudness * LOUD_MM / apart_mm * (1.0 - 0.5 * SHADOW * (1.0 - facing))
                out[number] += amplitude * amplitude
    for number in range(out.shape[0]):
        chance = 0.5
        if is_noisy and scene.kinds[state.kind].is_noisy != 0:
            chance = uniform(scene.seeds[world], 0, robot, STREAM_SOUND, time_ns, number)
        counts = math.sqrt(out[number]) + QUIET + (NOISY - QUIET) * chance
        out[number] = min(math.floor(counts + 0.5) if is_noisy else counts, COUNTS_MAX)
