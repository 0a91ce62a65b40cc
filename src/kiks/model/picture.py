"""Pictures of arenas: any lossless picture becomes brightness, 0 for floor and 1..255 for walls.

Black is floor. Whatever is not black must stay wall, so every conversion below keeps non-zero at least 1.
"""

from __future__ import annotations

import warnings
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError
from kiks.model.raster import cells_per_pixel

if TYPE_CHECKING:
    from PIL import Image

PICTURE_TYPES = ("PNG", "TIFF", "PPM", "BMP")
"""The types that are read, in Pillow's words; PPM includes PGM and PBM."""

PICTURE_BYTES_MAX = 64 << 20
"""Most bytes of a picture that comes from elsewhere than a file of one's own."""

_LOSSY = "Lossy compression smears walls into the floor. "
_LOSSY_TYPES = ("JPEG", "MPO", "JPEG2000", "WEBP", "AVIF")
_SAVE_AS = "Save the arena as PNG, TIF, PGM or BMP."


def read_picture(path: Path, mm_per_pixel: float) -> npt.NDArray[np.uint8]:
    """Read the brightness of a picture, its first frame if it has several.

    Args:
        path: The picture.
        mm_per_pixel: Edge of a pixel [mm]; with it the size is checked from the header, before pixels are decoded.

    Returns:
        uint8 [row, column] with row 0 on top: 0 = floor.

    Raises:
        ParameterError: If `mm_per_pixel` is out of range.
        ArenaError: If the file is missing, damaged, of another type, or too small or too large for an arena.
    """
    what = f"Picture {str(path)!r}"
    check_is_file(path, what)
    return _read(path, what, mm_per_pixel)


def decode_picture(data: bytes, mm_per_pixel: float, what: str = "The picture") -> npt.NDArray[np.uint8]:
    """Read the brightness of a picture that is in memory, by the rules of `read_picture`.

    Args:
        data: The bytes of the picture's file.
        mm_per_pixel: Edge of a pixel [mm].
        what: What messages call it.

    Raises:
        ParameterError: If `mm_per_pixel` is out of range.
        ArenaError: If it is damaged, of another type, too small or too large for an arena, or has too many bytes.
    """
    if len(data) > PICTURE_BYTES_MAX:
        raise ArenaError(
            f"{what} must have at most {PICTURE_BYTES_MAX >> 20} MiB, but has {len(data) / 2**20:.1f}. "
            "Save it as PNG, or draw a smaller one."
        )
    return _read(BytesIO(data), what, mm_per_pixel)


def _read(source: Path | BytesIO, what: str, mm_per_pixel: float) -> npt.NDArray[np.uint8]:
    from PIL import Image, UnidentifiedImageError

    with warnings.catch_warnings():
        # Pillow warns about large pictures and odd metadata: the size is checked here, and metadata do not matter.
        warnings.simplefilter("ignore")
        try:
            image = Image.open(source)
        except Image.DecompressionBombError as error:
            raise ArenaError(f"{what} must have at most 64 million pixels, but: {error} Draw a smaller one.") from None
        except UnidentifiedImageError:
            raise ArenaError(f"{what} must be a picture, but it is none or its header is damaged. {_SAVE_AS}") from None
        except Exception as error:
            raise _unreadable(what, error) from None
        with image:
            _check_type(image, what)
            try:
                cells_per_pixel(image.height, image.width, mm_per_pixel)
            except ArenaError as error:
                raise ArenaError(f"{what}: {error}") from None
            try:
                return _brightness(image, what)
            except ArenaError:
                raise
            except Exception as error:  # Pillow's decoders raise whatever they stumble over in a damaged file.
                raise _unreadable(what, error) from None


def read_start(path: Path, bytes_max: int, what: str) -> bytes:
    """Return a file, or its beginning if it is longer than anybody wants to know.

    Args:
        path: The path.
        bytes_max: Most bytes that are read.
        what: What the message calls it.

    Raises:
        ArenaError: If there is nothing, a folder, or no right to read.
    """
    check_is_file(path, what)
    try:
        with path.open("rb") as file:
            return file.read(bytes_max)
    except OSError as error:
        raise ArenaError(f"{what} must be readable, but: {error}. Check its rights.") from None


def check_is_file(path: Path, what: str) -> None:
    """Check that a path leads to a file.

    Args:
        path: The path.
        what: What the message calls it.

    Raises:
        ArenaError: If there is nothing, or a folder.
    """
    if path.is_dir():
        raise ArenaError(f"{what} must be a file, but it is a folder. Name a file in it.")
    if not path.is_file():
        raise ArenaError(
            f"{what} must exist, but there is no such file. Check the name and the folder {str(Path.cwd())!r}."
        )


def _unreadable(what: str, error: Exception) -> ArenaError:
    return ArenaError(f"{what} must be complete and readable, but: {error}. Save it again, or fetch it again.")


def _check_type(image: Image.Image, what: str) -> None:
    kind = f"of type {image.format}"
    is_lossy = image.format in _LOSSY_TYPES
    if image.format == "TIFF" and image.info.get("compression") in ("jpeg", "tiff_jpeg", "webp"):
        kind, is_lossy = f"a TIFF compressed with {image.info['compression']}", True
    if is_lossy or image.format not in PICTURE_TYPES:
        raise ArenaError(f"{what} must be a lossless picture, but it is {kind}. {_LOSSY if is_lossy else ''}{_SAVE_AS}")


def _brightness(image: Image.Image, what: str) -> npt.NDArray[np.uint8]:
    if image.has_transparency_data and not image.mode.startswith(("I", "F")):
        layered = image.convert("RGBA")
        is_clear = np.asarray(layered.getchannel("A")) == 0
        return np.where(is_clear, np.uint8(0), _grey_of_colour(layered.convert("RGB")))
    if image.mode == "1":
        return np.where(np.asarray(image), np.uint8(255), np.uint8(0))
    if image.mode == "L":
        return np.array(image)
    if image.mode.startswith(("I", "F")):
        return _grey_of_deep(np.asarray(image), _full_scale(image), what)
    return _grey_of_colour(image.convert("RGB"))


def _grey_of_colour(image: Image.Image) -> npt.NDArray[np.uint8]:
    grey: npt.NDArray[np.uint8] = np.array(image.convert("L"))
    grey[(grey == 0) & np.asarray(image).any(axis=2)] = 1
    return grey


def _full_scale(image: Image.Image) -> float | None:
    """Return the white of a deep picture, or nothing where its type does not fix it (32 bit)."""
    return 65535.0 if image.mode.startswith("I;16") or image.format in ("PNG", "PPM") else None


def _grey_of_deep(values: npt.NDArray[Any], white: float | None, what: str) -> npt.NDArray[np.uint8]:
    low, high = float(values.min()), float(values.max())
    if not (low >= 0 and high < np.inf):
        raise ArenaError(f"{what} must hold brightness from 0 up, but its values span {low:g}..{high:g}. {_SAVE_AS}")
    if white is None:
        # The narrowest usual scale that holds every value: fractions, 8, 16 or 32 bit.
        scales = [1.0] if values.dtype.kind == "f" else []
        white = next((scale for scale in [*scales, 255.0, 65535.0] if high <= scale), 4294967295.0)
    grey = np.minimum(np.rint(values * (255.0 / white)), 255)
    return np.where(values > 0, np.maximum(grey, 1), 0).astype(np.uint8)
