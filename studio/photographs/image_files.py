"""Image files of a camera: PNG, TIFF, JPEG, BMP and EXR, whole, of one page, upright, and within stated limits."""

from __future__ import annotations

import io
from dataclasses import dataclass
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
ORIENTATION = 0x0112
"""EXIF tag."""
PNG_DEPTH = 24
"""The byte of a PNG that tells the bits of a channel."""
TURNS = {
    2: "mirrored left to right",
    3: "turned by 180 degrees",
    4: "mirrored top to bottom",
    5: "turned by 90 degrees and mirrored",
    6: "turned by 90 degrees clockwise",
    7: "turned by 90 degrees and mirrored",
    8: "turned by 90 degrees counter-clockwise",
}
"""What EXIF asks a viewer to do."""


LEAST_SIDE, MOST_SIDE = 16, 1024
"""px of the piece of an image by which its colour is judged."""
ROWS_APART = 4
"""Of the rows of that piece that are looked at."""
COARSE, QUIET = 1.1, 0.9
"""Ratio of colour's change to brightness's, which is 1.4 for independent channels; and the share of the pixels, those
that change least, on which it is asked."""


@dataclass(frozen=True)
class Photograph:
    """An image file, upright."""

    pixels: NDArray[Any]
    """(h, w), or (h, w, 3) RGB where the channels differ, digital numbers."""
    turned: str
    """What was done because EXIF asks for it; empty: nothing."""
    lossy: bool
    """A colour JPEG, or what was one: colour at half resolution, and clipped pixels are not at one number."""


def load_photograph(path: Path) -> NDArray[Any]:
    """(h, w) or (h, w, 3) RGB digital numbers of an image file, upright. InputError: as `read_photograph`."""
    return read_photograph(path).pixels


def read_photograph(path: Path) -> Photograph:
    """A PNG, TIFF, JPEG, BMP or EXR, turned as EXIF says.

    InputError: missing, no regular file, too big, of several pages, damaged, or without channels RGB or Y.
    """
    data = read_bytes(path, MAX_BYTES, "image")
    if path.suffix.lower() == ".exr":
        return Photograph(_exr_image(data, str(path)), "", lossy=False)
    import cv2

    orientation, lossy, image = _checked(data, str(path))
    known = image is not None
    try:
        if image is None and data:
            image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None:
        allowed = f"a whole {KINDS}"
        raise InputError("the file is not an image, or is damaged", where=str(path), allowed=allowed)
    if image.ndim == 3 and image.shape[2] >= 3:
        red, green, blue = cv2.split(image)[:3] if known else cv2.split(image)[2::-1]
        grey = np.array_equal(red, green) and np.array_equal(green, blue)
        image = red if grey else cv2.merge((red, green, blue))
    elif image.ndim == 3:
        image = np.ascontiguousarray(image[..., 0])
    lossy = image.ndim == 3 and (lossy or has_coarse_colour(image))
    return Photograph(upright(image, orientation), TURNS.get(orientation, ""), lossy)


def has_coarse_colour(image: NDArray[Any]) -> bool:
    """Whether the colour of an 8-bit image (h, w, 3) changes less from pixel to pixel than its brightness does.

    That of independent channels changes more; a demosaiced, denoised or compressed one, also where it was stored as a
    PNG, changes less. Edges, as of the line, are left out.
    """
    if image.dtype != np.uint8 or min(image.shape[:2]) < LEAST_SIDE:
        return False
    part = image[tuple(slice(max((n - MOST_SIDE) // 2, 0), (n + MOST_SIDE) // 2) for n in image.shape[:2])]
    part = part[::ROWS_APART].astype(np.int16)

    def bends(values: NDArray[np.int16]) -> tuple[float, float]:
        sizes = np.abs(values[:, 2:] - 2 * values[:, 1:-1] + values[:, :-2]).ravel()
        count = max(int(QUIET * len(sizes)), 1)
        return float(np.mean(np.partition(sizes, count - 1)[:count])), float(np.mean(sizes))

    colour, brightness = bends(part[..., 0] - part[..., 2]), bends(part[..., 1])
    quiet = 0 if brightness[0] > 0.0 else 1  # compression may leave nothing but edges
    return colour[quiet] < COARSE * brightness[quiet]


def upright(image: NDArray[Any], orientation: int) -> NDArray[Any]:
    """(h, w, ...) as stored -> as it is to be seen, by the EXIF orientation 1 to 8."""
    if orientation in (5, 6, 7, 8):
        image = image.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        image = image[::-1]
    if orientation in (2, 3, 6, 7):
        image = image[:, ::-1]
    return np.ascontiguousarray(image)


def _checked(data: bytes, where: str) -> tuple[int, bool, NDArray[Any] | None]:
    """EXIF orientation, whether it is a JPEG, and, of a PNG of 8 bits, R, G, B or mono; what Pillow does not know is
    OpenCV's to judge.

    InputError: more pixels than MAX_PIXELS, or several pages.
    """
    from PIL import Image, ImageFile, UnidentifiedImageError

    ImageFile.LOAD_TRUNCATED_IMAGES = False  # WeasyPrint sets it for the whole program

    pixels = None
    try:
        with Image.open(io.BytesIO(data)) as image:
            # the further pages of an MPO are previews of the first, as phones keep them
            size, pages = image.size, 1 if image.format == "MPO" else getattr(image, "n_frames", 1)
            orientation, lossy = int(image.getexif().get(ORIENTATION, 1)), image.format in ("JPEG", "MPO")
            if image.format == "PNG" and size[0] * size[1] <= MAX_PIXELS:
                image.load()  # what is damaged is refused here, where libpng would print words of its own
                if data[PNG_DEPTH] == 8 and image.mode in ("L", "RGB", "RGBA"):
                    pixels = np.array(image)
    except UnidentifiedImageError:
        return 1, False, None
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
    return orientation, lossy, pixels


def _exr_image(data: bytes, where: str) -> NDArray[Any]:
    pixels = decode_exr(data, where, 4 * MAX_PIXELS)
    if {"R", "G", "B"} <= pixels.keys():
        return np.stack([np.asarray(pixels[name], dtype=np.float32) for name in "RGB"], axis=2)
    if "Y" in pixels or len(pixels) == 1:
        return np.asarray(pixels.get("Y", next(iter(pixels.values()))), dtype=np.float32)
    found = ", ".join(sorted(pixels))
    raise InputError("the EXR has no image of its own", where=where, found=found, allowed="channels R, G, B, or Y")
