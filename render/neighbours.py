"""Which pixels of a sparse set lie beside chosen ones."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Int = NDArray[np.int32]


@numba.njit(nogil=True, cache=True)
def with_neighbours(chosen: NDArray[np.bool_], pixels: Int, width: int) -> NDArray[np.bool_]:
    """(n,) chosen among ascending flat pixel indices (n,) -> the chosen ones and their 8 neighbours, where in the set.

    Across the left and right edge of an image neighbours wrap: a pixel too many costs little.
    """
    n = len(pixels)
    out = chosen.copy()
    # three places in the set that walk along with i: the row before, its own, the row after
    start = np.zeros(3, np.int64)
    for i in range(n):
        if not chosen[i]:
            continue
        for row in range(3):
            low = pixels[i] + (row - 1) * width - 1
            j = start[row]
            while j < n and pixels[j] < low:
                j += 1
            start[row] = j
            while j < n and pixels[j] <= low + 2:
                out[j] = True
                j += 1
    return out
