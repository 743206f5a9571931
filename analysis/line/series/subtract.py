"""A laser-off image taken from the laser-on image, so that only the laser's light stays; saturation is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import check_image
from analysis.line.detection.noise import image_saturation
from render.base.errors import InputError

ROOM = 0.5
"""Of the full scale; with less of it left by the off image, a saturated difference does not stand out as the line's."""


def subtract_off(
    image: NDArray[Any], off: NDArray[Any], saturation: float | None = None
) -> tuple[NDArray[np.float32], float | None]:
    """Images (h, w) or (h, w, 3) of one shape and type -> their difference in DN, and the number of saturated pixels.

    A pixel that the laser-on image saturates says "at least this much" where the off image leaves room for laser light,
    and then keeps the full scale; elsewhere, as in a lamp that saturates both, it keeps its difference, which is no
    light of the laser's. Of colour images all channels must be saturated: one alone would make a spike in their mean.
    The second value is the full scale, None where nothing is saturated; saturation: DN, of an image that does not tell
    it by its type. Raises InputError: another shape or type, or
    an off image brighter than the other.
    """
    image, off = check_image(image), check_image(off)
    if image.shape != off.shape:
        found = " x ".join(map(str, off.shape[1::-1])) + " px, " + ("colour" if off.ndim == 3 else "mono")
        allowed = " x ".join(map(str, image.shape[1::-1])) + " px, " + ("colour" if image.ndim == 3 else "mono")
        raise InputError("the laser-off image is of another size", where="off image", found=found, allowed=allowed)
    if image.dtype != off.dtype:
        raise InputError(
            "the laser-off image is of another type", where="off image", found=off.dtype, allowed=str(image.dtype)
        )
    difference = image.astype(np.float32) - off.astype(np.float32)
    # noise and flicker go both ways; a line that is darker than what is around it does not
    if np.nanmax(difference) <= max(-0.5 * float(np.nanmin(difference)), 0.0):
        cure = "give the laser-on image first"
        raise InputError("the laser-off image is the brighter one", where="off image", cure=cure)
    full = image_saturation(image) if saturation is None else saturation
    if full is not None:
        censored = (image >= full) & (off <= (1.0 - ROOM) * full)
        difference[censored if image.ndim == 2 else censored.all(axis=2)] = full
    return difference, full
