"""Files of films: pictures one after the other, as MP4 (H.264), GIF or WebP."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TypeVar, cast

import numpy as np

from kiks.export.palette import Palette
from kiks.export.stage import Pixels
from kiks.model.atomic_files import writing
from kiks.model.replaceable import MADE_BY

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
    sampled = np.linspace(0, len(instants) - 1, SAMPLE_COUNT).astype(int)
    samples = draw([instants[index] for index in sampled.tolist()])
    ending = Path(path).suffix.lower()
    with writing(path, "a film") as beside, VideoFile(beside.path, ending, size, fps, samples) as film:
        for number, picture in enumerate(draw(instants), 1):
            film.add(picture)
            on_progress(number / len(instants))


class VideoFile:
    """A film's file, whose end of `with` writes what is left. A GIF has the colours of some samples of its pictures."""

    def __init__(self, path: Path, ending: str, size: tuple[int, int], fps: int, samples: Iterable[Pixels]) -> None:
        import av
        from av.video.stream import VideoStream

        self._path, self._palette = path, Palette(samples) if ending == GIF else None
        self._count, self._time_base = 0, Fraction(1, fps)
        codec, pixel_format = _CODECS[ending]
        self._container = av.open(str(path), "w", format=ending[1:], container_options=_CONTAINERS[ending])
        self._stream = cast(VideoStream, self._container.add_stream(codec, rate=fps, options=_OPTIONS[ending]))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = pixel_format

    def add(self, picture: Pixels) -> None:
        """Append a picture."""
        import av

        if self._palette is None:
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
        else:
            # PyAV wants alpha, red, green and blue.
            colours = np.insert(self._palette.colours, 0, 255, axis=1)
            frame = av.VideoFrame.from_ndarray((self._palette.indices(picture), colours), format="pal8")  # type: ignore[arg-type]
        frame.pts, frame.time_base = self._count, self._time_base
        self._count += 1
        self._container.mux(self._stream.encode(frame))

    def __enter__(self) -> VideoFile:
        """Return itself."""
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Close the file, complete if there was no error."""
        try:
            if kind is None:
                self._container.mux(self._stream.encode(None))
        finally:
            self._container.close()
        if kind is None:
            # A box that no player reads; what follows a whole GIF or WebP, none reads either.
            with self._path.open("ab") as file:
                file.write(struct.pack(">I4s", 8 + len(MADE_BY), b"free") + MADE_BY.encode())
