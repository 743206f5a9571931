"""Photon merging, for light that no joint can bring: through clear glass or off mirrors before and after a surface.

The light arrives at its one rough surface between by a direction that only chance can give, and leaves by another, so a
camera path that ends within a small radius of where a light path ended is taken to be joined to it (progressive
photon mapping, Hachisuka and Jensen 2009; one radius a pass, Knaus and Zwicker 2011). It blurs by that radius, about a
pixel at first, ever less with the passes; all other light is joined without.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser_indirect.connection_buffer import BLOCK, Take
from render.laser_indirect.path_vertex import (
    BACK,
    CLEAR,
    LONE,
    NORMAL,
    PART,
    PIXEL,
    POWER,
    UNJOINED,
    mirror_at,
    scattered,
)

Float = NDArray[np.float64]
Long = NDArray[np.int64]

SHRINK = 1.0 / 6.0
"""The radius falls as n^-(1/6) with the passes (Knaus and Zwicker 2011, alpha = 2/3)."""


class Photons(NamedTuple):
    """(n, .) vertices in the order of their cells; (n,) power, part of the fan, cell; the cells' origin and size, m."""

    vertex: Float
    power: Float
    part: Long
    cell: Long
    corner: Float
    size: float
    paths: int


def photons(vertex: Float, state: Float, radius: float, paths: int) -> Photons:
    """Sort light vertices that only merging can use into cells of twice the radius."""
    lone = (state[:, LONE] > 0.0) & (state[:, CLEAR] > 0.0)
    vertex, power, part = vertex[lone], state[lone, POWER], state[lone, PART].astype(np.int64)
    corner = vertex[:, :3].min(axis=0) - 2.0 * radius if len(vertex) else np.zeros(3)
    size = 2.0 * radius
    place = np.floor((vertex[:, :3] - corner) / size).astype(np.int64)
    cell = (place[:, 0] << 42) | (place[:, 1] << 21) | place[:, 2]
    order = np.argsort(cell, kind="stable")
    return Photons(vertex[order], power[order], part[order], cell[order], corner, size, paths)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def merge(vertex: Float, state: Float, rows: Float, light: Photons, take: Take) -> None:
    """Add what the photons about each camera vertex bring."""
    radius = 0.5 * light.size
    share = 1.0 / (math.pi * radius * radius * light.paths)
    count = light.cell.shape[0]
    for r in range(vertex.shape[0]):
        if state[r, LONE] == 0.0 or state[r, CLEAR] == 0.0:
            continue
        v = vertex[r]
        if mirror_at(v, rows):
            continue
        # the two cells along each axis that the sphere can reach
        a = [int(math.floor((v[axis] - light.corner[axis]) / light.size - 0.5)) for axis in range(3)]
        total = 0.0
        for corner in range(8):
            x, y, z = a[0] + (corner & 1), a[1] + ((corner >> 1) & 1), a[2] + (corner >> 2)
            if x < 0 or y < 0 or z < 0 or x >= 1 << 20 or y >= 1 << 20 or z >= 1 << 20:
                continue
            key = (np.int64(x) << 42) | (np.int64(y) << 21) | np.int64(z)
            j = np.searchsorted(light.cell, key)
            while j < count and light.cell[j] == key:
                w = light.vertex[j]
                d0, d1, d2 = w[0] - v[0], w[1] - v[1], w[2] - v[2]
                if d0 * d0 + d1 * d1 + d2 * d2 < radius * radius:
                    alike = v[NORMAL] * w[NORMAL] + v[NORMAL + 1] * w[NORMAL + 1] + v[NORMAL + 2] * w[NORMAL + 2]
                    if alike > 0.7:
                        f = scattered(v, rows, w[BACK], w[BACK + 1], w[BACK + 2], v[BACK], v[BACK + 1], v[BACK + 2])
                        value = light.power[j] * f
                        if not 0.0 <= value < math.inf:
                            take.dropped[0] += 1.0
                            j += 1
                            continue
                        total += value
                        take.found[light.part[j]] += (state[r, POWER] * value * share) ** 2
                j += 1
        worth = state[r, POWER] * total * share
        if not 0.0 <= worth < math.inf:
            take.dropped[0] += 1.0
        elif worth > 0.0:
            pixel = int(state[r, PIXEL])
            take.image[pixel] += worth
            take.helped[pixel] += worth
            take.touched[pixel // BLOCK] = True
            take.sums[UNJOINED] += worth
