"""Pictures of arenas: any lossless picture becomes greys, and how far each pixel covers the floor.

Black is floor. Any other colour must stay wall, so each conversion below keeps non-zero values at least 1. What is
transparent shows the floor, whether that is drawn black or white.
"""

from __future__ import annotations

import warnings
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from kiks.errors import ArenaError, ParameterError, shown
from kiks.model.data_file import check_size, one_line, read_file
from kiks.model.limits import PICTURE_FILE_BYTES_MAX
from kiks.model.raster import cells_per_pixel

if TYPE_CHECKING:
    from PIL import Image

PICTURE_TYPES = ("PNG", "TIFF", "PPM", "BMP", "GIF", "WEBP")
"""The types that are read, in Pillow's words; PPM includes PGM and PBM. A WebP must be lossless."""

_BAND_PIXELS = 1 << 20
_LOSSY = "Lossy compression smears walls into the floor. "
_LOSSY_TYPES = ("JPEG", "MPO", "JPEG2000", "AVIF")
_SAVE_AS = "Save the arena as PNG, TIF, PGM or BMP."
_SAVE_AGAIN = "Save it again, or fetch it again."
_TILE_WIDTH, _TILE_LENGTH = 322, 323  # tags of TIFF 6.0, section 15


class Pixels(NamedTuple):
    """The pixels of a picture.

    Attributes:
        grey: uint8 [row, column] with row 0 on top: 0 for black alone.
        opacity: uint8 [row, column]: 0 where it is fully transparent, 255 where it is not at all.
    """

    grey: npt.NDArray[np.uint8]
    opacity: npt.NDArray[np.uint8]

    @property
    def brightness(self) -> npt.NDArray[np.uint8]:
        """The walls of a picture with a black floor: 0 where it is fully transparent, else `grey`."""
        return np.where(self.opacity == 0, np.uint8(0), self.grey)

    @property
    def on_white(self) -> npt.NDArray[np.uint8]:
        """The greys of a picture with a white floor, as a drawing program shows them."""
        darkness = (255 - self.grey).astype(np.uint16) * self.opacity // 255
        return (255 - darkness).astype(np.uint8)


def read_picture(path: Path, mm_per_pixel: float) -> Pixels:
    """Read the pixels of a picture, its first frame if it has several.

    Args:
        path: The picture.
        mm_per_pixel: Edge of a pixel [mm]; with it the size is checked from the header, before pixels are decoded.
    """
    what = f"Picture {shown(str(path))}"
    return decode_picture(read_file(path, what, bytes_max=PICTURE_FILE_BYTES_MAX, error=ArenaError), mm_per_pixel, what)


def decode_picture(data: bytes, mm_per_pixel: float, what: str = "The picture") -> Pixels:
    """Read the pixels of a picture that is in memory, by the rules of `read_picture`."""
    from PIL import Image, UnidentifiedImageError

    check_size(data, what, bytes_max=PICTURE_FILE_BYTES_MAX, error=ArenaError)
    with warnings.catch_warnings():
        # Pillow warns about large pictures and odd metadata: this function checks the size, and metadata do not matter.
        warnings.simplefilter("ignore")
        try:
            with Image.open(BytesIO(data)) as image:
                _check_type(image, data)
                cells_per_pixel(image.height, image.width, mm_per_pixel)
                _check_tiles(image)
                return _pixels(image)
        except ArenaError as error:
            raise ArenaError(f"{what}: {error}") from None
        except ParameterError:
            raise
        except Image.DecompressionBombError:
            raise ArenaError(f"{what} must have at most 64 million pixels, but has more. Draw a smaller one.") from None
        except UnidentifiedImageError:
            raise ArenaError(f"{what} must be a picture, but it is none or its header is damaged. {_SAVE_AS}") from None
        except Exception as error:  # Pillow's decoders raise many kinds of exceptions for a damaged file.
            raise ArenaError(f"{what} must be complete and readable, but: {one_line(error)}. {_SAVE_AGAIN}") from None


_KEPT_BYTES_MAX = 4 << 20
"""Largest raster whose PNG is kept [bytes]."""


def encode_picture(brightness: npt.NDArray[np.uint8], *, compress_level: int = 6) -> bytes:
    """Return the PNG of a raster, uint8 [row, column] or [row, column, colour] with row 0 at the bottom."""
    data = np.ascontiguousarray(brightness).tobytes()
    # Worlds in one arena differ in seed and start: their walls are packed once.
    encode = _encoded if len(data) <= _KEPT_BYTES_MAX else _encoded.__wrapped__
    return encode(data, brightness.shape, compress_level)


@lru_cache(8)
def _encoded(data: bytes, shape: tuple[int, ...], compress_level: int) -> bytes:
    from PIL import Image

    brightness = np.frombuffer(data, np.uint8).reshape(shape)
    file = BytesIO()
    Image.fromarray(np.flipud(brightness)).save(file, "PNG", compress_level=compress_level)
    return file.getvalue()


def _check_type(image: Image.Image, data: bytes) -> None:
    kind = f"of type {image.format}"
    # The chunk with the pixels of a lossless WebP is VP8L, of another VP8 (RFC 9649, section 2).
    is_lossy = image.format in _LOSSY_TYPES or (image.format == "WEBP" and b"VP8L" not in data[12:4096])
    if image.format == "TIFF" and image.info.get("compression") in ("jpeg", "tiff_jpeg", "webp"):
        kind, is_lossy = f"a TIFF compressed with {image.info['compression']}", True
    if is_lossy or image.format not in PICTURE_TYPES:
        raise ArenaError(f"It must be a lossless picture, but it is {kind}. {_LOSSY if is_lossy else ''}{_SAVE_AS}")


def _check_tiles(image: Image.Image) -> None:
    """Check that no tile of a TIFF, which is unpacked whole, is much larger than the picture."""
    tags = getattr(image, "tag_v2", {})
    pixels = tags.get(_TILE_WIDTH, 0) * tags.get(_TILE_LENGTH, 0)
    if pixels > max(image.width * image.height, _BAND_PIXELS):
        raise ArenaError(f"Its tiles must be smaller than the picture, but they have {pixels} pixels. {_SAVE_AS}")


def _pixels(image: Image.Image) -> Pixels:
    """Decode a picture, and convert it to grey in bands of rows: a whole copy in colours takes hundreds of MB."""
    image.load()
    rows = max(_BAND_PIXELS // image.width, 1)
    bands = [(top, min(top + rows, image.height)) for top in range(0, image.height, rows)]

    def band(top: int, bottom: int) -> Image.Image:
        return image.crop((0, top, image.width, bottom))

    grey = np.empty((image.height, image.width), np.uint8)
    opacity = np.broadcast_to(np.uint8(255), grey.shape)
    if image.mode.startswith(("I", "F")):
        ends = [(values.min(), values.max()) for values in (np.asarray(band(*each)) for each in bands)]
        white = _white(image, float(np.min(ends)), float(np.max(ends)))
        for top, bottom in bands:
            grey[top:bottom] = _grey_of_deep(np.asarray(band(top, bottom)), white)
    elif image.has_transparency_data:
        opacity = np.empty_like(grey)
        for top, bottom in bands:
            layered = band(top, bottom).convert("RGBA")
            grey[top:bottom], opacity[top:bottom] = _grey_of_colour(layered), np.asarray(layered.getchannel("A"))
    else:
        for top, bottom in bands:
            grey[top:bottom] = _grey_of_colour(band(top, bottom))
    return Pixels(grey, opacity)


def _grey_of_colour(image: Image.Image) -> npt.NDArray[np.uint8]:
    if image.mode in ("1", "L"):
        return np.asarray(image.convert("L"))
    colours = image.convert("RGB")
    grey: npt.NDArray[np.uint8] = np.array(colours.convert("L"))
    grey[(grey == 0) & np.asarray(colours).any(axis=2)] = 1
    return grey


def _white(image: Image.Image, low: float, high: float) -> float:
    """Return the white of a deep picture that has values from `low` to `high`."""
    if not (low >= 0 and high < np.inf):
        raise ArenaError(f"It must hold brightness from 0 up, but its values span {low:g}..{high:g}. {_SAVE_AS}")
    if image.mode.startswith("I;16") or image.format in ("PNG", "PPM"):
        return 65535.0
    # The narrowest usual scale that holds every value: fractions, 8, 16 or 32 bit.
    scales = [*([1.0] if image.mode == "F" else []), 255.0, 65535.0]
    return next((scale for scale in scales if high <= scale), 4294967295.0)


def _grey_of_deep(values: npt.NDArray[Any], white: float) -> npt.NDArray[np.uint8]:
    grey = np.minimum(np.rint(values * (255.0 / white)), 255)
    return np.where(values > 0, np.maximum(grey, 1), 0).astype(np.uint8)
