"""Where the pixels of a large image are not zero, looked for on threads."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Int
from render.base.threads import map_chunks

CHUNK = 1 << 18
"""Values that a thread looks at, at a time."""


def nonzero_places(values: NDArray[Any], threads: int | None = None) -> Int:
    """(n,) ascending flat indices of what is not zero in a contiguous array of less than 2^31 values."""
    flat = values.ravel()
    found: list[Int] = [np.zeros(0, np.int32)] * -(-len(flat) // CHUNK)

    def work(start: int, stop: int) -> None:
        found[start // CHUNK] = (np.flatnonzero(flat[start:stop]) + start).astype(np.int32)

    map_chunks(work, len(flat), CHUNK, threads)
    return np.concatenate([np.zeros(0, np.int32), *found])
