"""Image files of a camera: PNG, TIFF, JPEG, BMP and EXR, whole, of one page, and within stated limits."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.base.files import read_bytes
from render.output.exr import decode_exr

MAX_BYTES = 2**29
MAX_PIXELS = 2**27
"""Far above any line camera's; as float32 RGB 1.6 GB."""
KINDS = "PNG, TIFF, JPEG, BMP or EXR"


def load_photograph(path: Path) -> NDArray[Any]:
    """(h, w) or (h, w, 3) RGB digital numbers of a PNG, TIFF, JPEG, BMP or EXR.

    InputError: missing, no regular file, too big, of several pages, damaged, or without channels RGB or Y.
    """
    data = read_bytes(path, MAX_BYTES, "image")
    if path.suffix.lower() == ".exr":
        return _exr_image(data, str(path))
    import cv2

    _check_pages(data, str(path))
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    except cv2.error:
        image = None
    if image is None:
        allowed = f"a whole {KINDS}"
        raise InputError("the file is not an image, or is damaged", where=str(path), allowed=allowed)
    if image.ndim == 3:
        image = np.ascontiguousarray(image[:, :, 2::-1])
    return np.asarray(image)


def _check_pages(data: bytes, where: str) -> None:
    """InputError: more pixels than MAX_PIXELS, or several pages; what Pillow does not know is OpenCV's to judge."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(data)) as image:
            size, pages = image.size, getattr(image, "n_frames", 1)
            if image.format == "PNG" and size[0] * size[1] <= MAX_PIXELS:
                image.load()  # what is damaged is refused here, where libpng would print words of its own
    except UnidentifiedImageError:
        return
    except Image.DecompressionBombError:
        size, pages = (MAX_PIXELS, 2), 1
    except Exception as error:  # Pillow raises many kinds on damaged data, in words of its own
        raise InputError("the image is damaged", where=where, allowed=f"a whole {KINDS}") from error
    if size[0] * size[1] > MAX_PIXELS:
        found, allowed = f"{size[0]} x {size[1]} pixels", f"at most {MAX_PIXELS} pixels"
        raise InputError("the image is too big", where=where, found=found, allowed=allowed)
    if pages > 1:
        cure = "save each page as an image of its own"
        raise InputError("the image has several pages", where=where, found=pages, allowed="one", cure=cure)


def _exr_image(data: bytes, where: str) -> NDArray[Any]:
    pixels = decode_exr(data, where, 4 * MAX_PIXELS)
    if {"R", "G", "B"} <= pixels.keys():
        return np.stack([np.asarray(pixels[name], dtype=np.float32) for name in "RGB"], axis=2)
    if "Y" in pixels or len(pixels) == 1:
        return np.asarray(pixels.get("Y", next(iter(pixels.values()))), dtype=np.float32)
    found = ", ".join(sorted(pixels))
    raise InputError("the EXR has no image of its own", where=where, found=found, allowed="channels R, G, B, or Y")
