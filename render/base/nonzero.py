"""Where the pixels of a large image are not zero, looked for on threads."""

from __future__ import annotations

import numba
import numpy as np

from render.base.arrays import Float, Float32, Int
from render.base.threads import map_chunks

CHUNK = 1 << 18
"""Values that a thread looks at, at a time."""


def nonzero_places(values: Float | Float32, threads: int | None = None) -> Int:
    """(n,) ascending flat indices of what is not zero in a contiguous array of less than 2^31 values."""
    flat = values.ravel()
    found: list[Int] = [np.zeros(0, np.int32)] * -(-len(flat) // CHUNK)

    def work(start: int, stop: int) -> None:
        room = np.empty(stop - start, np.int32)
        found[start // CHUNK] = room[: find_nonzero(flat, start, stop, room)].copy()

    map_chunks(work, len(flat), CHUNK, threads)
    return np.concatenate([np.zeros(0, np.int32), *found])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def find_nonzero(values: Float | Float32, start: int, stop: int, out: Int) -> int:
    """Indices from start to stop of values (n,) that are not zero -> the first of out (stop - start,); how many."""
    count = 0
    for i in range(start, stop):
        # written anyway and kept or not: a branch that nobody can foresee takes longer
        out[count] = i
        count += values[i] != 0.0
    return count
