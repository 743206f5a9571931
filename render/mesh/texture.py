"""Images as linear reflectance."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float32
from render.base.errors import InputError
from render.base.files import read_bytes

MAX_PIXELS = 25_000_000
"""Limit of one image, and of all of a scene together: 0.3 GB once decoded, twice that while a world is built."""
MAX_FILE_BYTES = 2**29
CHUNK = 2**20
"""Codes a table look-up: NumPy copies indices to 8 bytes a code."""
ALLOWED = "a whole PNG, JPEG, TIFF, BMP or WebP image of 8 or 16 bit"


def srgb_to_linear(values: NDArray[Any]) -> NDArray[np.float64]:
    """sRGB code values in [0, 1] to linear (IEC 61966-2-1)."""
    values = np.asarray(values, dtype=np.float64)
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(values: NDArray[Any]) -> NDArray[np.float64]:
    """Linear values in [0, 1] to sRGB code values (IEC 61966-2-1)."""
    values = np.asarray(values, dtype=np.float64)
    return np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055)


def linear_reflectance(codes: NDArray[Any], *, srgb: bool = True) -> Float32:
    """Codes of any shape, uint8 or uint16, to linear float32 in [0, 1]."""
    top = np.iinfo(codes.dtype).max
    table = np.arange(top + 1) / top
    table = (srgb_to_linear(table) if srgb else table).astype(np.float32)
    linear = np.empty(codes.shape, np.float32)
    given, found = np.ascontiguousarray(codes).reshape(-1), linear.reshape(-1)
    for start in range(0, given.size, CHUNK):
        part = slice(start, start + CHUNK)
        found[part] = table[given[part]]
    return linear


def load_texture(path: Path, *, srgb: bool, scale: float, where: str) -> Float32:
    """(h, w, 3) float32 linear reflectance of an image file, row 0 at the top; grey becomes RGB, alpha is dropped.

    scale: multiplies the values. where: the field, for messages.
    InputError: absent, not an image, damaged, or of more than MAX_PIXELS.
    """
    if not path.exists():
        cure = "put the image into the project folder, or give a number instead"
        raise InputError("the texture is not there", where=where, found=path.name, cure=cure)
    place = f"{where}: {path.name}"
    return decode_texture(read_bytes(path, MAX_FILE_BYTES, "texture", place), srgb=srgb, scale=scale, where=place)


def image_size(data: bytes, where: str) -> tuple[int, int]:
    """Width and height of an image file's bytes; nothing is decoded.

    InputError: no image that Pillow knows, of more than MAX_PIXELS, or of several pages.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(data)) as image:
            (width, height), pages = image.size, getattr(image, "n_frames", 1)
    except Image.DecompressionBombError:
        width, height, pages = MAX_PIXELS, 3, 1  # what Pillow refuses has more
    except UnidentifiedImageError:
        raise InputError("the texture cannot be read", where=where, found="no image", allowed=ALLOWED) from None
    except MemoryError:
        raise
    except Exception as error:  # Pillow raises many kinds on damaged data, in words of its own
        raise InputError("the texture cannot be read", where=where, found="damaged data", allowed=ALLOWED) from error
    if width * height > MAX_PIXELS:
        raise InputError(
            "the texture is too large",
            where=where,
            found=f"{width} x {height} pixels",
            allowed=f"at most {MAX_PIXELS} pixels",
            cure="scale the image down",
        )
    if pages > 1:
        cure = "save the one that is meant as an image of its own"
        raise InputError("the image has several pages", where=where, found=pages, allowed="one", cure=cure)
    return width, height


def decode_texture(data: bytes, *, srgb: bool, scale: float, where: str) -> Float32:
    """As `load_texture`, from an image file's bytes."""
    import cv2
    from PIL import Image, ImageFile

    # WeasyPrint, once a report was made, has Pillow take cut images for whole ones
    ImageFile.LOAD_TRUNCATED_IMAGES = False
    image_size(data, where)
    try:
        with Image.open(io.BytesIO(data)) as image:
            image.load()  # Pillow refuses a cut image; OpenCV keeps 16 bit
        del image
        codes: NDArray[Any] | None = cv2.imdecode(
            np.frombuffer(data, dtype=np.uint8),
            cv2.IMREAD_COLOR_RGB | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION,
        )
        if codes is None:  # a format that only Pillow knows
            with Image.open(io.BytesIO(data)) as image:
                codes = np.asarray(image.convert("RGB"))
    except MemoryError:
        raise
    except Exception as error:  # Pillow and OpenCV raise many kinds on damaged data, in words of their own
        found = "an image that is cut short or damaged"
        raise InputError("the texture cannot be read", where=where, found=found, allowed=ALLOWED) from error
    if codes.dtype not in (np.uint8, np.uint16):
        raise InputError("the texture's number type is not known", where=where, found=codes.dtype, allowed=ALLOWED)
    linear = linear_reflectance(codes, srgb=srgb)
    linear *= np.float32(scale)
    return linear
