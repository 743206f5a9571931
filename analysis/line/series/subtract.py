"""A laser-off image taken from the laser-on image, so that only the laser's light stays; saturation is kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import check_image
from analysis.line.detection.noise import image_saturation
from render.base.errors import InputError


def subtract_off(image: NDArray[Any], off: NDArray[Any]) -> tuple[NDArray[np.float32], float | None]:
    """Images (h, w) or (h, w, 3) of one shape and type -> their difference in DN, and the number of saturated pixels.

    Pixels that the laser-on image saturates keep its full scale, since their difference says nothing; the second value
    is that scale, None without them. Raises InputError: another shape or type, or an off image brighter than the other.
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
    full = image_saturation(image)
    if full is not None:
        difference[image >= full] = full
    return difference, full
