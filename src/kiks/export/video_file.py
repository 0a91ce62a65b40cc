"""Files of films: pictures one after the other, as MP4 (H.264), GIF or WebP."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import cast

import numpy as np

from kiks.export.palette import Palette
from kiks.export.stage import Pixels
from kiks.model.replaceable import MADE_BY

MP4, GIF, WEBP = ".mp4", ".gif", ".webp"

_CODECS = {MP4: ("libx264", "yuv420p"), GIF: ("gif", "pal8"), WEBP: ("libwebp_anim", "bgra")}
_OPTIONS = {
    # Flat colours and still walls: `animation` keeps edges sharp. The macroblock tree of x264 differs in each call.
    MP4: {"preset": "veryfast", "crf": "20", "tune": "animation", "x264-params": "mbtree=0"},
    GIF: {},
    # Drawings take half the bytes of a lossy film.
    WEBP: {"lossless": "1", "compression_level": "2"},
}
_CONTAINERS = {MP4: {"movflags": "+faststart"}, GIF: {"loop": "0"}, WEBP: {"loop": "0"}}


class VideoFile:
    """A film's file, whose end of `with` writes what is left. A GIF has the colours of some samples of its pictures."""

    def __init__(self, path: Path, ending: str, size: tuple[int, int], fps: int, samples: Iterable[Pixels]) -> None:
        import av
        from av.video.stream import VideoStream

        self._path, self._ending = path, ending
        self._palette = Palette(samples) if ending == GIF else None
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
            _sign(self._path, self._ending)


def _sign(path: Path, ending: str) -> None:
    """Leave `MADE_BY` at the end of a film's file, where its format has a comment, which its writer cannot write."""
    mark = MADE_BY.encode()
    with path.open("r+b") as file:
        size = file.seek(0, os.SEEK_END)
        if ending == MP4:
            file.write(struct.pack(">I", 8 + len(mark)) + b"free" + mark)
        elif ending == GIF:
            file.seek(size - 1)  # before the trailer
            file.write(b"!\xfe" + bytes([len(mark)]) + mark + b"\0;")
        else:
            file.write(b"KiKS" + struct.pack("<I", len(mark)) + mark + b"\0" * (len(mark) % 2))
            size = file.tell() - 8
            file.seek(4)
            file.write(struct.pack("<I", size))
