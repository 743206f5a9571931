"""A path of ambient light at one surface, as scalars: where it meets it, and how its BSDF scatters it.

Records of scalars cost nothing between kernels, named tuples of arrays do: what is in arrays (the material's row, its
reflectance, the shading frame) is passed beside the records.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float, Int
from render.base.vectors import Vector, along, divided, dot, length, minus, negative, rotated, scaled, times, vector
from render.material.bsdf import SUBSURFACE, evaluate, pdf, sample
from render.material.record import ALPHA_X, ALPHA_Y, BSDF_COLUMNS, KIND
from render.material.scattering import Numbers
from render.world.triangles import facet, to_world


class Path(NamedTuple):
    """A path on its way to its next surface."""

    origin: Vector
    direction: Vector
    """Unit."""
    throughput: Vector
    """What a radiance of 1 in R, G, B that is met adds to the pixel."""
    bsdf_pdf: float
    """As in `PathState`."""


class Hit(NamedTuple):
    """Where a path meets a triangle; at an infinite distance where it meets none."""

    point: Vector
    normal: Vector
    """Unit, by the winding."""
    distance: float
    cosine: float
    """Of the path with the normal."""


class Vertex(NamedTuple):
    """Where a path is scattered, without what is in arrays: its material's row, reflectance and shading frame."""

    point: Vector
    normal: Vector
    """The facet's, on the side that the path comes from; of a boundary the winding's."""
    wo: Vector
    """Direction that the path comes from, in the shading frame; not set where the BSDF is diffuse."""
    throughput: Vector
    """Of the path that comes here."""
    outside: int
    """Overlapping bodies that the path is within before its surface (`render.world.interior_list`)."""
    bit: int
    """Of the body of this surface; 0: it overlaps none."""


class BsdfValue(NamedTuple):
    """The BSDF at a vertex towards a light."""

    f: Vector
    """1/sr."""
    cosine: float
    """With the normal that is shaded; 0 where light would leak through the facet, or go through a medium."""
    pdf: float
    """With which the path could have been scattered there, 1/sr."""
    interior: int
    """The overlapping bodies that a ray there is within."""


class Continued(NamedTuple):
    """How a path goes on."""

    direction: Vector
    throughput: Vector
    bsdf_pdf: float
    """As in `PathState`; 0: nothing is scattered."""
    side: float
    """1: on the side of the vertex's normal, -1: on the other."""
    interior: int
    medium: int


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def hit_of(vertices: Float, triangles: Int, t: int, path: Path) -> Hit:
    """Where a path meets the plane of triangle t; -1: it meets none."""
    if t < 0:
        return Hit((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), np.inf, 0.0)
    a0, a1, a2, n0, n1, n2 = facet(vertices, triangles, t)
    normal = scaled(1.0 / length((n0, n1, n2)), (n0, n1, n2))
    cosine = dot(normal, path.direction)
    distance = dot(normal, minus((a0, a1, a2), path.origin)) / cosine
    return Hit(along(path.origin, distance, path.direction), normal, distance, cosine)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def fill_row(materials: Float, slot: int, alpha: Float, row: Float) -> None:
    """What a BSDF reads of a material -> row (BSDF_COLUMNS,), with the roughness of the point."""
    for column in range(BSDF_COLUMNS):
        row[column] = materials[slot, column]
    row[ALPHA_X], row[ALPHA_Y] = alpha[0], alpha[1]


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def local_direction(path: Path, frame: Float, turned: bool) -> Vector:
    """Where a path comes from, in the shading frame (3, 3), which is turned over first if asked."""
    if turned:
        for axis in range(3):
            frame[0, axis], frame[2, axis] = -frame[0, axis], -frame[2, axis]
    return negative(rotated(frame, path.direction))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def vertex_of(path: Path, hit: Hit, wo: Vector, turned: bool, outside: int, bit: int) -> Vertex:
    """The vertex where a path meets a surface; turned: its normal is turned over."""
    normal = negative(hit.normal) if turned else hit.normal
    return Vertex(hit.point, normal, wo, path.throughput, outside, bit)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_diffuse(v: Vertex, albedo: Vector, direction: Vector) -> BsdfValue:
    """A Lambertian BSDF towards a light."""
    cosine = dot(v.normal, direction)
    return BsdfValue(divided(albedo, math.pi), max(cosine, 0.0), cosine / math.pi, v.outside)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_bsdf(v: Vertex, row: Float, albedo: Vector, frame: Float, direction: Vector) -> BsdfValue:
    """Any other BSDF towards a light."""
    facing, wi = dot(v.normal, direction), rotated(frame, direction)
    # on one side of the facet and of the normal that is shaded, and not through a medium
    is_open = wi[2] * facing > 0.0 and (row[KIND] != SUBSURFACE or wi[2] > 0.0)
    interior = v.outside if wi[2] > 0.0 else v.outside | v.bit
    f, bsdf_pdf = evaluate(row, albedo, v.wo, wi), pdf(row, albedo, v.wo, wi)
    return BsdfValue(f, abs(wi[2]) if is_open else 0.0, bsdf_pdf, interior)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scatter_diffuse(v: Vertex, albedo: Vector, r1: float, r2: float) -> Continued:
    """Draw the direction in which a path goes on from a Lambertian surface."""
    direction, cosine = cosine_direction(r1, r2, v.normal)
    return Continued(direction, times(v.throughput, albedo), cosine * (1.0 / math.pi), 1.0, v.outside, 0)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scatter(
    v: Vertex, slot: int, row: Float, albedo: Vector, frame: Float, numbers: Numbers, weight: Float
) -> Continued:
    """Draw the direction in which a path goes on, as any other BSDF of material `slot` says.

    weight: room for 3 numbers.
    """
    wi, bsdf_pdf = sample(row, albedo, v.wo, numbers, weight)
    direction = to_world(frame, wi)
    facing = dot(v.normal, direction)
    if facing * wi[2] <= 0.0:
        bsdf_pdf = 0.0
    interior, medium = v.outside, 0
    if wi[2] < 0.0:
        interior = v.outside | v.bit
        medium = slot + 1 if row[KIND] == SUBSURFACE else 0
    side = 1.0 if facing > 0.0 else -1.0
    return Continued(direction, times(v.throughput, vector(weight)), bsdf_pdf, side, interior, medium)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def with_guide(bsdf: BsdfValue, share: float, guide_pdf: float) -> BsdfValue:
    """A BSDF towards a direction, where a share of the directions is drawn with another pdf, 1/sr."""
    return BsdfValue(bsdf.f, bsdf.cosine, (1.0 - share) * bsdf.pdf + share * guide_pdf, bsdf.interior)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scattered_to(v: Vertex, direction: Vector, bsdf: BsdfValue) -> Continued:
    """How a path goes on in a direction that was drawn with the pdf of its value."""
    side = 1.0 if dot(v.normal, direction) > 0.0 else -1.0
    if not bsdf.cosine > 0.0:
        return Continued(direction, (0.0, 0.0, 0.0), 0.0, side, bsdf.interior, 0)
    throughput = scaled(bsdf.cosine / bsdf.pdf, times(v.throughput, bsdf.f))
    return Continued(direction, throughput, bsdf.pdf, side, bsdf.interior, 0)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def beside_guide(on: Continued, share: float, guide_pdf: float) -> Continued:
    """How a path goes on as its BSDF was sampled, where a share of the directions is drawn with another pdf, 1/sr."""
    pdf = (1.0 - share) * on.bsdf_pdf + share * guide_pdf
    factor = on.bsdf_pdf / pdf
    if on.bsdf_pdf <= 0.0:
        # nothing else leads to a single direction
        pdf, factor = on.bsdf_pdf, 1.0 / (1.0 - share)
    return Continued(on.direction, scaled(factor, on.throughput), pdf, on.side, on.interior, on.medium)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cosine_direction(r1: float, r2: float, normal: Vector) -> tuple[Vector, float]:
    """A cosine-distributed direction about a unit normal, by Duff et al. 2017, and its cosine."""
    n0, n1, n2 = normal
    radius = math.sqrt(r1)
    x, y = sincos_2pi(r2)
    x, y, z = radius * x, radius * y, math.sqrt(1.0 - r1)
    sign = 1.0 if n2 >= 0.0 else -1.0
    c = -1.0 / (sign + n2)
    b = n0 * n1 * c
    t0 = x * (1.0 + sign * n0 * n0 * c) + y * b + z * n0
    t1 = x * sign * b + y * (sign + n1 * n1 * c) + z * n1
    return (t0, t1, -x * sign * n0 - y * n1 + z * n2), z


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sincos_2pi(r: float) -> tuple[float, float]:
    """Cosine and sine of 2 pi r, r in [0, 1], to 2e-9, by Taylor's series about the nearest quarter: half the time."""
    quarter = int(4.0 * r + 0.5)
    x = (4.0 * r - quarter) * (0.5 * math.pi)
    q = x * x
    c = 1.0 - q / 2 * (1.0 - q / 12 * (1.0 - q / 30 * (1.0 - q / 56 * (1.0 - q / 90))))
    s = x * (1.0 - q / 6 * (1.0 - q / 20 * (1.0 - q / 42 * (1.0 - q / 72))))
    if quarter & 1:
        c, s = -s, c
    return (-c, -s) if quarter & 2 else (c, s)
