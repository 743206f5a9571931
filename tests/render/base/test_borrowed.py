"""Arrays without an owner are the same arrays, and nothing is freed twice or kept."""

from __future__ import annotations

import sys
from typing import NamedTuple

import numba
import numpy as np
from numba.core.runtime import _nrt_python, rtsys

from render.base.arrays import Float, Int
from render.base.borrowed import borrowed


class Parts(NamedTuple):
    values: Float
    places: Int
    factor: float


@numba.njit(cache=False)
def add(values: Float, parts: Parts) -> None:
    for i in range(parts.places.shape[0]):
        values[parts.places[i]] += parts.factor * parts.values[i]


@numba.njit(cache=False)
def add_borrowed(values: Float, parts: Parts, times: int) -> float:
    """Returns the last of a room of its own, which must live as long as it is used."""
    values, parts = borrowed(values), borrowed(parts)
    room = np.zeros(3), np.zeros(times)
    first, second = borrowed(room)
    for k in range(times):
        add(values, parts)
        second[k] = first.shape[0] + k
    last = second[times - 1]
    room[0][0] = 0.0
    return last


def test_borrowed_arrays_are_the_same_arrays_and_are_released_once() -> None:
    random = np.random.default_rng(1)
    parts = Parts(random.random(5), np.array([0, 3, 3, 1, 6], np.int32), 0.5)
    expected, found = np.zeros(8), np.zeros(8)
    for _ in range(4):
        add(expected, parts)
    _nrt_python.memsys_enable_stats()
    before, references = rtsys.get_allocation_stats(), sys.getrefcount(parts.values)
    last = add_borrowed(found, parts, 4)
    after, references_after = rtsys.get_allocation_stats(), sys.getrefcount(parts.values)
    assert last == 6.0
    np.testing.assert_array_equal(found, expected)
    assert references_after == references
    assert after.alloc - before.alloc == after.free - before.free
