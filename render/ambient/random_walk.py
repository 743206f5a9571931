"""Light followed back through a homogeneous medium: a random walk in three bands at once.

The length of a flight is drawn for one band, chosen by its weight, and weighed for all three by the mean of the bands'
densities (Veach's balance heuristic), so that no band is noisier than the one that carries most. What is scattered
inside is not connected to a lamp: the boundary bends light. Scattering is that of Henyey and Greenstein (1941).
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient.path_state import Wave
from render.material.bsdf import ANISOTROPY, EXTINCTION, SCATTERED
from render.material.medium import MOST_STEPS, turn
from render.sampling.random import uniform

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

WALK, NUMBERS = 1 << 20, 5
"""First of the random dimensions that walks use, and how many each step does."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def wander(
    walking: Int,
    distance: Float32,
    rows: Float,
    seed: int,
    pixels: Int,
    depth: int,
    step: int,
    wave: Wave,
    triangle: Int,
) -> int:
    """One flight of each path in `walking` (n,): those that scatter before the boundary stay in it, in front.

    distance (n,): to the boundary along each path's ray. Origin, direction and weight in `wave` are moved; a path that
    is absorbed, or found no boundary, weighs nothing and gets triangle -1. Returns how many stay.
    """
    left = 0
    d, w, extinction, chance = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for place in range(walking.shape[0]):
        r = walking[place]
        owner, s = wave.owner[r], wave.sample[r]
        index, first = 2 * pixels[owner >> 1] + (owner & 1), WALK + NUMBERS * (depth * MOST_STEPS + step)
        row = rows[wave.medium[r] - 1]
        total = 0.0
        for band in range(3):
            w[band], extinction[band] = wave.weight[r, band], row[EXTINCTION + band]
            total += w[band]
        if triangle[r] < 0 or total <= 0.0 or step == MOST_STEPS - 1:
            triangle[r] = -1
            wave.weight[r, 0] = wave.weight[r, 1] = wave.weight[r, 2] = 0.0
            continue
        number, chosen = uniform(seed, index, s, first) * total, 0
        while chosen < 2 and (number >= w[chosen] or w[chosen] == 0.0):
            number -= w[chosen]
            chosen += 1
        flight = -math.log(1.0 - uniform(seed, index, s, first + 1)) / extinction[chosen]
        inside = flight < distance[place]
        length = flight if inside else float(distance[place])
        density = 0.0
        for band in range(3):
            chance[band] = math.exp(-extinction[band] * length) * (extinction[band] if inside else 1.0)
            density += w[band] / total * chance[band]
        largest = 0.0
        for band in range(3):
            w[band] *= chance[band] / density * (row[SCATTERED + band] if inside else 1.0)
            largest = max(largest, w[band])
        if inside:
            # what is nearly absorbed ends by chance
            stay = min(1.0, largest)
            if uniform(seed, index, s, first + 4) >= stay:
                triangle[r] = -1
                wave.weight[r, 0] = wave.weight[r, 1] = wave.weight[r, 2] = 0.0
                continue
            for band in range(3):
                w[band] /= stay
            for axis in range(3):
                wave.origin[r, axis] += flight * wave.direction[r, axis]
                d[axis] = wave.direction[r, axis]
            g, r1 = row[ANISOTROPY], uniform(seed, index, s, first + 2)
            if abs(g) < 1e-3:
                cosine = 1.0 - 2.0 * r1
            else:
                part = (1.0 - g * g) / (1.0 - g + 2.0 * g * r1)
                cosine = (1.0 + g * g - part * part) / (2.0 * g)
            sine, phi = math.sqrt(max(0.0, 1.0 - cosine * cosine)), 2.0 * math.pi * uniform(seed, index, s, first + 3)
            turn(d, sine * math.cos(phi), sine * math.sin(phi), cosine)
            for axis in range(3):
                wave.direction[r, axis] = d[axis]
            walking[left] = r
            left += 1
        for band in range(3):
            wave.weight[r, band] = w[band]
    return left
