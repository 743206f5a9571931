"""Images as linear reflectance."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.errors import InputError

Float32 = NDArray[np.float32]

MAX_PIXELS = 2**26
"""About 0.8 GB once decoded."""


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
    return (srgb_to_linear(table) if srgb else table).astype(np.float32)[codes]


def load_texture(path: Path, *, srgb: bool, scale: float, where: str) -> Float32:
    """(h, w, 3) float32 linear reflectance of an image file, row 0 at the top; grey becomes RGB, alpha is dropped.

    scale: multiplies the values. where: the field, for messages.
    InputError: absent, not an image, damaged, or of more than MAX_PIXELS.
    """
    if not path.is_file():
        raise InputError(
            "the texture is not there" if not path.exists() else "the texture is not a file",
            where=where,
            found=path.name,
            cure="put the image into the project folder, or give a number instead",
        )
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError("the texture cannot be read", where=where, found=error.strerror or error) from error
    return decode_texture(data, srgb=srgb, scale=scale, where=f"{where}: {path.name}")


def decode_texture(data: bytes, *, srgb: bool, scale: float, where: str) -> Float32:
    """As `load_texture`, from an image file's bytes."""
    import cv2
    from PIL import Image, ImageFile

    # WeasyPrint, once a report was made, has Pillow take cut images for whole ones
    ImageFile.LOAD_TRUNCATED_IMAGES = False
    allowed = "a whole PNG, JPEG, TIFF, BMP or WebP image of 8 or 16 bit"
    try:
        # Pillow tells the size before decoding and refuses a cut image; OpenCV keeps 16 bit.
        with Image.open(io.BytesIO(data)) as image:
            width, height = image.size
            if width * height > MAX_PIXELS:
                raise InputError(
                    "the texture is too large",
                    where=where,
                    found=f"{width} x {height} pixels",
                    allowed=f"at most {MAX_PIXELS} pixels",
                    cure="scale the image down",
                )
            image.load()
            codes: NDArray[Any] | None = cv2.imdecode(
                np.frombuffer(data, dtype=np.uint8),
                cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION,
            )
            if codes is None:  # a format that only Pillow knows
                codes = np.asarray(image.convert("RGB"))[:, :, ::-1]
    except InputError:
        raise
    except Exception as error:  # Pillow and OpenCV raise many kinds on damaged data
        raise InputError("the texture cannot be read", where=where, found=error, allowed=allowed) from error
    if codes.dtype not in (np.uint8, np.uint16):
        raise InputError("the texture's number type is not known", where=where, found=codes.dtype, allowed=allowed)
    linear = linear_reflectance(codes[:, :, ::-1], srgb=srgb)
    return np.ascontiguousarray(linear * np.float32(scale))
