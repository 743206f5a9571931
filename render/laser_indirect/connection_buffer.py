"""Connections between path vertices, the shadow rays that test them, and the buffers of a pass that they splat to."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Bool, Float, Float32, Int, Long
from render.base.borrowed import borrowed
from render.base.vectors import Vector, along, minus, store_row, vector
from render.laser_indirect.path_vertex import PassContext, Record, cosine_to

RIS_SAMPLE_WEIGHT = 32.0
"""Samples that a connection chosen by RIS counts for in the balance heuristic, per camera path.

Any positive constant is unbiased, as the weights of all techniques still sum to 1; it only says how far a connection is
trusted beside one to the laser or to the camera. A connection chosen from M candidates has about the variance of M to
single random vertices; 32 is the most candidates there may be.
"""
BLOCK = 64
"""Pixels that are looked at or skipped together where passes are added up."""


class Connections(NamedTuple):
    """(n,) connections: pixel, contribution; (n, 3) shadow rays from scene-centred origins, and (n,) their length."""

    pixel: Int
    kind: Int
    fan_bin: Int
    """Bin of the fan that the light path left the laser by; -1: not known."""
    reachable_from_camera: Bool
    """Techniques that start at the camera can make this path as well."""
    contribution: Float
    origin: Float32
    direction: Float32
    distance: Float32
    interior: Long
    """The overlapping bodies that the shadow ray begins in (`render.world.interior_list`)."""


class PassBuffer(NamedTuple):
    """What one pass accumulates."""

    image: Float32
    """(pixels,) radiance."""
    camera_radiance: Float32
    """(pixels,) of it, what techniques that start at the camera can make as well."""
    sums: Float
    """(KINDS,) by kind of light (`render.laser_indirect.path_vertex`)."""
    fan_moments: Float
    """(FAN_BINS,) sum of the squared contributions of light from each bin of the fan."""
    wave_moments: Float
    """(rows of the guide, BINS) sum of the squared target weights that `connect_by_ris` met."""
    invalid: Float
    """(1,) contributions that were NaN, infinite or negative, which are dropped."""
    touched: Bool
    """(pixels / BLOCK,) where there may be something in `image` or `camera_radiance`."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def clear_pass(buffer: PassBuffer) -> None:
    """Zero a pass's buffer, for another."""
    buffer = borrowed(buffer)
    for block in range(buffer.touched.shape[0]):
        if buffer.touched[block]:
            buffer.image[block * BLOCK : (block + 1) * BLOCK] = 0.0
            buffer.camera_radiance[block * BLOCK : (block + 1) * BLOCK] = 0.0
            buffer.touched[block] = False
    buffer.sums[:] = 0.0
    buffer.fan_moments[:] = 0.0
    buffer.invalid[:] = 0.0


def empty_connections(n: int) -> Connections:
    """Room for n."""
    return Connections(
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.ones(n, np.bool_),
        np.empty(n),
        np.empty((n, 3), np.float32),
        np.empty((n, 3), np.float32),
        np.empty(n, np.float32),
        np.empty(n, np.int64),
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def set_shadow_ray(
    connections: Connections,
    j: int,
    v: Record,
    direction: Vector,
    distance: float,
    context: PassContext,
) -> None:
    """Shadow ray of connection j from vertex v along a unit direction."""
    side = context.ray_epsilon if cosine_to(v, direction) > 0.0 else -context.ray_epsilon
    store_row(connections.origin, j, along(minus(vector(v.p), vector(context.centre)), side, vector(v.n)))
    store_row(connections.direction, j, direction)
    connections.distance[j] = distance


@numba.njit(nogil=True, cache=True)
def splat_unoccluded(connections: Connections, occluded: Bool, count: int, scale: float, buffer: PassBuffer) -> None:
    """Splat the connections that nothing occludes: to the image, the sum of their kind of light, the fan's moments."""
    connections, occluded, buffer = borrowed(connections), borrowed(occluded), borrowed(buffer)
    for j in range(count):
        if occluded[j]:
            continue
        contribution = connections.contribution[j] * scale
        if not 0.0 <= contribution < math.inf:
            buffer.invalid[0] += 1.0
            continue
        pixel = connections.pixel[j]
        buffer.image[pixel] += contribution
        buffer.touched[pixel // BLOCK] = True
        buffer.sums[connections.kind[j]] += contribution
        if connections.reachable_from_camera[j]:
            buffer.camera_radiance[pixel] += contribution
        if connections.fan_bin[j] >= 0:
            buffer.fan_moments[connections.fan_bin[j]] += contribution * contribution
