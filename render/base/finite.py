"""The check between stages: NaN or infinity ends the work, with the stage and the likely cause named."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from render.base.errors import InputError
from render.base.threads import map_chunks

AT_ONCE = 1 << 18
"""Values that a thread adds up at a time."""
CURES = {
    "render": "bring the scene's numbers (distances, widths, powers, distortion) nearer to those of a real scanner",
    "sensor": "bring the sensor's numbers (exposure, gain, noise, full well) nearer to those of a real camera",
    "line": "look for pixels that are no numbers in the image, or choose another extraction.method",
    "points": "check the camera's distortion and the poses of camera and laser",
    "errors": "check the poses of camera and laser, and the mesh",
}


def check_finite(stage: str, **arrays: NDArray[np.floating]) -> None:
    """InputError: an array that `stage`, a key of `CURES`, hands on holds NaN or an infinity; keywords name them."""
    for name, values in arrays.items():
        # a sum needs no array of its own
        if math.isfinite(_total(values)):
            continue
        bad = int(np.count_nonzero(~np.isfinite(values)))
        if bad:
            raise InputError(
                f"the stage gave {name.replace('_', ' ')} that are no finite numbers",
                where=f"stage {stage!r}",
                found=f"{bad} of {values.size} values NaN or infinite",
                allowed="finite numbers",
                cure=CURES[stage],
            )


def _total(values: NDArray[np.floating]) -> float:
    """The sum, which of float32 cannot overflow float64."""
    rows = np.atleast_1d(values)
    step = max(AT_ONCE * len(rows) // max(rows.size, 1), 1)
    sums = np.zeros(-(-len(rows) // step))

    def work(start: int, stop: int) -> None:
        with np.errstate(invalid="ignore", over="ignore"):
            sums[start // step] = rows[start:stop].sum(dtype=np.float64)

    map_chunks(work, len(rows), step)
    with np.errstate(invalid="ignore", over="ignore"):
        return float(sums.sum())


def known(value: float) -> float | None:
    """For a file of JSON, which has no NaN."""
    return value if math.isfinite(value) else None
