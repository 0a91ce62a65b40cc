"""Files of films: pictures one after the other, as MP4 (H.264), GIF or WebP."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from kiks.export.palette import Palette
from kiks.export.stage import Pixels
from kiks.model.atomic_files import writing
from kiks.model.replaceable import MADE_BY

if TYPE_CHECKING:
    import av

MP4, GIF, WEBP = ".mp4", ".gif", ".webp"

SAMPLE_COUNT = 16
"""Pictures whose colours a GIF has."""

_CODECS = {MP4: ("libx264", "yuv420p"), GIF: ("gif", "pal8"), WEBP: ("libwebp_anim", "bgra")}
_OPTIONS = {
    # Flat colours and still walls: `animation` keeps edges sharp. The macroblock tree of x264 differs in each call.
    MP4: {"preset": "veryfast", "crf": "20", "tune": "animation", "x264-params": "mbtree=0"},
    GIF: {},
    # Drawings take half the bytes of a lossy film.
    WEBP: {"lossless": "1", "compression_level": "2"},
}
_CONTAINERS = {MP4: {"movflags": "+faststart"}, GIF: {"loop": "0"}, WEBP: {"loop": "0"}}


Instant = TypeVar("Instant")


def write_film(
    path: str | Path,
    size: tuple[int, int],
    fps: int,
    instants: Sequence[Instant],
    draw: Callable[[Sequence[Instant]], Iterator[Pixels]],
    on_progress: Callable[[float], object],
) -> None:
    """Write a film.

    Args:
        path: Its file.
        size: Width and height [pixels].
        fps: Pictures per second.
        instants: What each picture shows.
        draw: Yields the pictures of some of them.
        on_progress: Called after each picture with the share that is done.
    """
    import av
    from av.video.stream import VideoStream

    ending = Path(path).suffix.lower()
    palette = None
    if ending == GIF:
        sampled = np.linspace(0, len(instants) - 1, SAMPLE_COUNT).astype(int)
        palette = Palette(draw([instants[index] for index in sampled.tolist()]))
    codec, pixel_format = _CODECS[ending]
    with writing(path, "a film") as beside:
        with av.open(str(beside.path), "w", format=ending[1:], container_options=_CONTAINERS[ending]) as container:
            stream = cast(VideoStream, container.add_stream(codec, rate=fps, options=_OPTIONS[ending]))
            stream.width, stream.height = size
            stream.pix_fmt = pixel_format
            for number, picture in enumerate(draw(instants)):
                frame = _frame(picture, palette)
                frame.pts, frame.time_base = number, Fraction(1, fps)
                container.mux(stream.encode(frame))
                on_progress((number + 1) / len(instants))
            container.mux(stream.encode(None))
        # A box that no player reads; what follows a whole GIF or WebP, none reads either.
        with beside.path.open("ab") as file:
            file.write(struct.pack(">I4s", 8 + len(MADE_BY), b"free") + MADE_BY.encode())


def _frame(picture: Pixels, palette: Palette | None) -> av.VideoFrame:
    """Return a picture for a film, in the colours of a palette if it has one."""
    import av

    if palette is None:
        return av.VideoFrame.from_ndarray(picture, format="rgb24")
    # PyAV wants alpha, red, green and blue.
    colours = np.insert(palette.colours, 0, 255, axis=1)
    return av.VideoFrame.from_ndarray((palette.indices(picture), colours), format="pal8")  # type: ignore[arg-type]
