"""What the kernels of a bounce hand to each other: the scene, a path's ray, and where it meets a surface."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.ambient.light_sampling import (
    Lights,
)
from render.ambient.path_state import (
    PathState,
    sequence_index,
)
from render.world.triangles import Surface

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]


class PathScene(NamedTuple):
    """What the paths move in, and what decides them."""

    surface: Surface
    lights: Lights
    environment: Float
    """(3,) radiance."""
    table: Float32
    """`pair_table`."""
    seed: int
    pixels: Int
    """(m,) of the chunk."""
    centre: Float
    """(3,) that the ray engine's coordinates are relative to."""
    ray_epsilon: float
    """m, how far off a surface a ray begins."""
    max_depth: int
    """Surfaces that light may meet; after so many only lights are looked for."""
    clamp: float
    """The most radiance that a contribution by way of two and more surfaces may add."""


class Ray(NamedTuple):
    """A path's ray in float64: origin in the world, direction, throughput; and whose it is."""

    o0: float
    o1: float
    o2: float
    d0: float
    d1: float
    d2: float
    w0: float
    w1: float
    w2: float
    bsdf_pdf: float
    pixel_slot: int
    sequence: int
    sample: int
    base: int
    """First random dimension of the surface that it meets."""


class SurfacePoint(NamedTuple):
    """Where a path meets a surface: point and normal, which is turned towards the ray but for boundaries."""

    p0: float
    p1: float
    p2: float
    n0: float
    n1: float
    n2: float
    material: int
    diffuse: bool
    """Lambertian, shaded on its facet's normal: neither `wo` nor `frame` is needed."""


class Shading(NamedTuple):
    """Arrays that a kernel fills anew for every path."""

    row: Float
    """(ROW,) the material."""
    rho: Float
    """(3,) reflectance."""
    alpha: Float
    """(2,) roughness."""
    frame: Float
    """(3, 3) axes, one a row."""
    wo: Float
    wi: Float
    f: Float
    """(3,) of a BSDF, or of a sample's f cos / pdf."""
    lamp: Float
    lamp_normal: Float


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def ray_of(scene: PathScene, paths: PathState, r: int, base: int) -> Ray:
    """Path r's ray; base: first random dimension of the surface that it meets."""
    origin, direction, throughput = paths.origin[r], paths.direction[r], paths.throughput[r]
    pixel_slot = paths.pixel_slot[r]
    return Ray(
        origin[0] + scene.centre[0],
        origin[1] + scene.centre[1],
        origin[2] + scene.centre[2],
        float(direction[0]),
        float(direction[1]),
        float(direction[2]),
        float(throughput[0]),
        float(throughput[1]),
        float(throughput[2]),
        float(paths.bsdf_pdf[r]),
        pixel_slot,
        sequence_index(scene.pixels, pixel_slot),
        paths.sample[r],
        base,
    )
