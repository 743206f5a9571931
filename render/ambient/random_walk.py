"""Light followed back through a homogeneous medium: a random walk in three bands at once.

The length of a flight is drawn for one band, chosen by its throughput, and weighted for all three by the mean of the
bands' pdfs (balance heuristic, Veach 1997), so that no band is noisier than the one that carries most. What is
scattered inside is not connected to a lamp: the boundary refracts. Scattering is that of Henyey and Greenstein (1941).
"""

from __future__ import annotations

import math

import numba
import numpy as np

from render.ambient.path_state import PathState, Samples
from render.base.arrays import Float, Float32, Int
from render.base.borrowed import borrowed
from render.material.bsdf import ANISOTROPY, EXTINCTION, SCATTERED
from render.material.medium import MOST_STEPS, henyey_greenstein, turn
from render.sampling.random import uniform

FIRST_WALK_DIMENSION, NUMBERS = 1 << 20, 5
"""First of the random dimensions that walks use, and how many each step does."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def random_walk_step(
    walking: Int,
    distance: Float32,
    rows: Float,
    samples: Samples,
    depth: int,
    step: int,
    paths: PathState,
    triangle: Int,
) -> int:
    """One flight of each path in `walking` (n,): those that scatter before the boundary stay in it, in front.

    distance (n,): to the boundary along each path's ray. Origin, direction and throughput in `paths` are moved; a path
    that is absorbed, or found no boundary, carries nothing and gets triangle -1. Returns how many stay.
    """
    walking, distance, rows, samples = borrowed(walking), borrowed(distance), borrowed(rows), borrowed(samples)
    paths, triangle = borrowed(paths), borrowed(triangle)
    seed, keys = samples.seed, samples.keys
    left = 0
    d, w, extinction, pdf = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for place in range(walking.shape[0]):
        r = walking[place]
        pixel_slot, s = paths.pixel_slot[r], paths.sample[r]
        index, first = (
            2 * keys[pixel_slot >> 1] + (pixel_slot & 1),
            FIRST_WALK_DIMENSION + NUMBERS * (depth * MOST_STEPS + step),
        )
        row = rows[paths.medium[r] - 1]
        total = 0.0
        for band in range(3):
            w[band], extinction[band] = paths.throughput[r, band], row[EXTINCTION + band]
            total += w[band]
        if triangle[r] < 0 or total <= 0.0 or step == MOST_STEPS - 1:
            triangle[r] = -1
            paths.throughput[r, 0] = paths.throughput[r, 1] = paths.throughput[r, 2] = 0.0
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
            pdf[band] = math.exp(-extinction[band] * length) * (extinction[band] if inside else 1.0)
            density += w[band] / total * pdf[band]
        largest = 0.0
        for band in range(3):
            w[band] *= pdf[band] / density * (row[SCATTERED + band] if inside else 1.0)
            largest = max(largest, w[band])
        if inside:
            # what is nearly absorbed ends by chance
            survival = min(1.0, largest)
            if uniform(seed, index, s, first + 4) >= survival:
                triangle[r] = -1
                paths.throughput[r, 0] = paths.throughput[r, 1] = paths.throughput[r, 2] = 0.0
                continue
            for band in range(3):
                w[band] /= survival
            for axis in range(3):
                paths.origin[r, axis] += flight * paths.direction[r, axis]
                d[axis] = paths.direction[r, axis]
            cosine = henyey_greenstein(row[ANISOTROPY], uniform(seed, index, s, first + 2))
            sine, phi = math.sqrt(max(0.0, 1.0 - cosine * cosine)), 2.0 * math.pi * uniform(seed, index, s, first + 3)
            turn(d, sine * math.cos(phi), sine * math.sin(phi), cosine)
            for axis in range(3):
                paths.direction[r, axis] = d[axis]
            walking[left] = r
            left += 1
        for band in range(3):
            paths.throughput[r, band] = w[band]
    return left
