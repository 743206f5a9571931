"""Joints between paths, the shadow rays that decide whether they count, and what they add to."""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

JOINS = 32.0
"""What one resampled joint among many candidates counts for, in joints to a single random vertex."""


BLOCK = 64
"""Pixels that are looked at or skipped together where passes are added up."""


class Joints(NamedTuple):
    """(n,) pixel and worth of joints; (n, 3) origins (scene-centred), directions and (n,) length of shadow rays."""

    pixel: Int
    kind: Int
    part: Int
    """Of the fan that the light left by; -1: not known."""
    helped: NDArray[np.bool_]
    """Camera paths make this path as well."""
    worth: Float
    origin: Float32
    direction: Float32
    far: Float32


class Take(NamedTuple):
    """What a pass adds to."""

    image: Float
    """(pixels,) radiance."""
    helped: Float32
    """(pixels,) of it, what camera paths could help with."""
    sums: Float
    """(KINDS,) by kind of light (`render.laser_indirect.path_vertex`)."""
    found: Float
    """(PARTS,) squared worth of what came from each part of the fan."""
    learnt: Float
    """As in `join_light`."""
    dropped: Float
    """(1,) joints whose worth was no number, infinite or negative."""
    touched: NDArray[np.bool_]
    """(pixels / BLOCK,) where there may be something in `image` or `helped`."""


class Lit(NamedTuple):
    """Light vertices to be joined to: the rows of `render.laser_indirect.path_vertex`."""

    vertex: Float
    state: Float
    ordered: bool
    """They follow each other along the fan: the first surface's."""
    paths: int
    """Traced in all."""


def no_joints(n: int) -> Joints:
    """Room for n."""
    return Joints(
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.empty(n, np.int32),
        np.ones(n, np.bool_),
        np.empty(n),
        np.empty((n, 3), np.float32),
        np.empty((n, 3), np.float32),
        np.empty(n, np.float32),
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cast(
    joints: Joints,
    j: int,
    v: Float,
    d0: float,
    d1: float,
    d2: float,
    out: float,
    far: float,
    centre: Float,
    offset: float,
) -> None:
    """Aim the shadow ray of joint j from vertex v along d; out: cosine with the geometric normal."""
    side = offset if out > 0.0 else -offset
    for axis in range(3):
        joints.origin[j, axis] = v[axis] - centre[axis] + side * v[3 + axis]
    joints.direction[j, 0], joints.direction[j, 1], joints.direction[j, 2] = d0, d1, d2
    joints.far[j] = far


@numba.njit(nogil=True, cache=True)
def count_joints(joints: Joints, blocked: NDArray[np.bool_], count: int, scale: float, take: Take) -> None:
    """Add the clear joints to the image, to the sum of their kind of light, and to what their part of the fan found."""
    for j in range(count):
        if not blocked[j]:
            worth = joints.worth[j] * scale
            if not 0.0 <= worth < math.inf:
                take.dropped[0] += 1.0
                continue
            take.image[joints.pixel[j]] += worth
            take.touched[joints.pixel[j] // BLOCK] = True
            take.sums[joints.kind[j]] += worth
            if joints.helped[j]:
                take.helped[joints.pixel[j]] += worth
            if joints.part[j] >= 0:
                take.found[joints.part[j]] += worth * worth
