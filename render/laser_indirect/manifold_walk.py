"""Manifold walks: how a point and the camera or the laser see each other over a chain of plane mirrors and clear glass.

A ray through the lens's point is (q, r, 1) in the camera's frame, one from the laser's apex likewise in the laser's.
Refracted and reflected at the planes of given facets it meets the plane of a point's surface at F(q, r); the walk
solves F(q, r) = x for the point x, by Newton's method on the manifold of paths that obey Snell's law (Jakob and
Marschner 2012; Zeltner et al. 2020). The chain is a list of facets, which makes the solution unique and its probability
1: between planes the optical path is a convex function of the points on them, a sum of distances times indices, and it
is least on the one path that obeys the law (Fermat). The last matrix of Newton's method then says how many pixels there
are to an area about x,

    du dv / dA  =  (du dv / dq dr) / |dF/dq x dF/dr|,

the generalised geometry term of the chain, times the share of light that Fresnel's equations let through.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

from render.base.arrays import Float
from render.base.vectors import (
    Vector,
    along,
    divided,
    dot,
    length,
    minus,
    plus,
    row_vector,
    scaled,
    store_row,
    vector,
)
from render.camera.lens import lens_position, lens_project
from render.camera.view import View
from render.laser_indirect.path_vertex import MOST_FACETS, Record, Records
from render.material.bsdf import DIELECTRIC, eval_band
from render.material.fresnel import fresnel_dielectric
from render.material.record import INDEX, INTERNAL, KIND, METAL_K, METAL_N
from render.material.scattering import Lobes
from render.world.triangles import Surface, barycentric, plane_of, slot_reflectance

MOST_ITERATIONS, MOST_HALVINGS = 16, 8
LAST_STEP = 1e-5
"""Of Newton's method, in slopes q and r: between planes, whose map bends by less than a tenth over the image, what such
a step leaves is below 1e-9, 4e-6 px at a focal length of 3500 px."""
STEP = 1e-6
"""Of the difference quotients, in slopes."""
BEYOND = 0.25
"""How far past an edge of a facet, over the facet's width, the first guess may be for the walk to go on: between planes
it is nearly the solution. Chosen, not tuned."""


class Solution(NamedTuple):
    """A path from a point to the camera."""

    found: bool
    slopes: tuple[float, float]
    """q and r."""
    spread: float
    """|dF/dq x dF/dr|, m^2."""


NO_SOLUTION = Solution(False, (0.0, 0.0), 0.0)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def facet_plane(surface: Surface, facet: int) -> tuple[Vector, float, float]:
    """Unit normal of a facet's plane, its distance from the origin along it, and refractive index; 0: it reflects."""
    a0, a1, a2, n0, n1, n2 = plane_of(surface, abs(facet) - 1)
    index = surface.rows[surface.object_id[facet - 1], INDEX] if facet > 0 else 0.0
    return (n0, n1, n2), n0 * a0 + n1 * a1 + n2 * a2, index


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def past_plane(normal: Vector, distance: float, index: float, o: Vector, d: Vector) -> tuple[bool, Vector, Vector]:
    """A ray of unit direction on from a plane, as of `facet_plane`. False: it does not come there, or is not
    refracted."""
    c = -dot(normal, d)
    s = (dot(normal, o) - distance) / c
    if not s > 0.0:
        return False, o, d
    o = along(o, s, d)
    if index == 0.0:
        return True, o, plus(d, scaled(2.0 * c, normal))
    eta = index if c > 0.0 else 1.0 / index
    sine2 = (1.0 - c * c) / (eta * eta)
    if sine2 >= 1.0:
        return False, o, d
    return True, o, plus(scaled(1.0 / eta, d), scaled(c / eta - math.copysign(math.sqrt(1.0 - sine2), c), normal))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def turned(surface: Surface, facet: int, o: Vector, d: Vector) -> tuple[bool, Vector, Vector]:
    """A ray of unit direction on from the plane of a facet (`facets` of `path_vertex.PATH`), as if this had no edge.

    False: it does not come to the plane, or is not refracted there.
    """
    return past_plane(*facet_plane(surface, facet), o, d)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def set_planes(surface: Surface, chain: Record, planes: Float) -> None:
    """The planes of a chain, as of `facet_plane` -> planes (MOST_FACETS, 5)."""
    for j in range(chain.count):
        normal, distance, index = facet_plane(surface, chain.facets[j])
        store_row(planes, j, normal)
        planes[j, 3], planes[j, 4] = distance, index


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def turned_at(planes: Float, j: int, o: Vector, d: Vector) -> tuple[bool, Vector, Vector]:
    """As `turned`, at one of the planes of a chain (`set_planes`)."""
    return past_plane(row_vector(planes, j), planes[j, 3], planes[j, 4], o, d)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def towards_slopes(m: Float, q: float, r: float) -> Vector:
    """The unit direction of slopes q and r in a pose's frame."""
    d = (
        m[0, 0] * q + m[0, 1] * r + m[0, 2],
        m[1, 0] * q + m[1, 1] * r + m[1, 2],
        m[2, 0] * q + m[2, 1] * r + m[2, 2],
    )
    return divided(d, length(d))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def landing(
    planes: Float, count: int, m: Float, origin: Vector, q: float, r: float, x: Vector, n: Vector
) -> tuple[bool, Vector]:
    """F(q, r), over `count` planes, on the plane through x with normal n; False: there is none."""
    o, d = origin, towards_slopes(m, q, r)
    for j in range(count):
        ok, o, d = turned_at(planes, j, o, d)
        if not ok:
            return False, o
    s = dot(n, minus(x, o)) / dot(n, d)
    return s > 0.0, along(o, s, d)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def set_steps(surface: Surface, chains: Records, m: Float, origin: Vector) -> None:
    """Records (n,) of `specular_chains.SEEN` -> `steps`: by how much the slopes of the ray that comes to a point beside
    where each has landed differ from its own, for each metre that the point is off. m: as for `walk`."""
    planes = np.empty((MOST_FACETS, 5))
    for i in range(chains.shape[0]):
        chain = chains[i]
        set_planes(surface, chain, planes)
        (q, r), o, d, count = chain.slopes, vector(chain.o), vector(chain.d), chain.count
        ok, p = landing(planes, count, m, origin, q, r, o, d)
        ok_q, p_q = landing(planes, count, m, origin, q + STEP, r, o, d)
        ok_r, p_r = landing(planes, count, m, origin, q, r + STEP, o, d)
        by_q, by_r = scaled(1.0 / STEP, minus(p_q, p)), scaled(1.0 / STEP, minus(p_r, p))
        qq, qr, rr = dot(by_q, by_q), dot(by_q, by_r), dot(by_r, by_r)
        determinant = qq * rr - qr * qr
        known = ok and ok_q and ok_r and determinant > 0.0
        for axis in range(3):
            chain.steps[0, axis] = (rr * by_q[axis] - qr * by_r[axis]) / determinant if known else 0.0
            chain.steps[1, axis] = (qq * by_r[axis] - qr * by_q[axis]) / determinant if known else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def goes_past(surface: Surface, chain: Record, planes: Float, m: Float, origin: Vector, q: float, r: float) -> bool:
    """Whether a ray comes to the plane of a facet far from the facet."""
    o, d = origin, towards_slopes(m, q, r)
    for j in range(chain.count):
        ok, o, d = turned_at(planes, j, o, d)
        if not ok:
            return False
        f, g = barycentric(surface, abs(chain.facets[j]) - 1, o)
        if min(f, g, 1.0 - f - g) < -BEYOND:
            return True
    return False


@numba.njit(nogil=True, cache=True, error_model="numpy")
def walk(
    surface: Surface,
    chain: Record,
    m: Float,
    origin: Vector,
    x: Vector,
    n: Vector,
    planes: Float,
) -> Solution:
    """The ray from a point, of the lens or the laser, that comes over a chain to x, of a plane with normal n, or
    NO_SOLUTION.

    chain: a record of `specular_chains.SEEN`, whose facets are taken without their edges, but that a ray far past one
    is not looked for; its slopes and steps are the first guess. m (4, 4): the pose of camera or laser; planes: for
    `set_planes`. A step that does not bring it nearer is halved.
    """
    set_planes(surface, chain, planes)
    count, off = chain.count, minus(x, vector(chain.o))
    q = chain.slopes[0] + dot(row_vector(chain.steps, 0), off)
    r = chain.slopes[1] + dot(row_vector(chain.steps, 1), off)
    if goes_past(surface, chain, planes, m, origin, q, r):
        return NO_SOLUTION
    ok, p = landing(planes, count, m, origin, q, r, x, n)
    for _ in range(MOST_ITERATIONS):
        ok_q, p_q = landing(planes, count, m, origin, q + STEP, r, x, n)
        ok_r, p_r = landing(planes, count, m, origin, q, r + STEP, x, n)
        if not (ok and ok_q and ok_r):
            return NO_SOLUTION
        by_q, by_r, off = scaled(1.0 / STEP, minus(p_q, p)), scaled(1.0 / STEP, minus(p_r, p)), minus(x, p)
        qq, qr, rr = dot(by_q, by_q), dot(by_q, by_r), dot(by_r, by_r)
        determinant = qq * rr - qr * qr
        oq, orr = dot(by_q, off), dot(by_r, off)
        dq, dr = (rr * oq - qr * orr) / determinant, (qq * orr - qr * oq) / determinant
        if not determinant > 0.0:
            return NO_SOLUTION
        if abs(dq) + abs(dr) <= LAST_STEP:
            return Solution(True, (q + dq, r + dr), math.sqrt(determinant))
        distance, factor = length(off), 1.0
        for _ in range(MOST_HALVINGS):
            ok, p = landing(planes, count, m, origin, q + factor * dq, r + factor * dr, x, n)
            if ok and length(minus(x, p)) < distance:
                break
            factor *= 0.5
        q, r = q + factor * dq, r + factor * dr
    return NO_SOLUTION


@numba.njit(nogil=True, cache=True, error_model="numpy")
def passed(  # noqa: PLR0913
    surface: Surface,
    weights: Float,
    chain: Record,
    m: Float,
    origin: Vector,
    slopes: tuple[float, float],
    from_light: bool,
    places: Float,
    rgb: Float,
) -> float:
    """The weight of a path after a chain, as `path_vertex.scatter` has it -> places (count, 3) on the facets.

    0: it goes past the edge of one. Radiance, which camera paths carry, changes with the square of the refractive
    index; power, from the light, does not. weights (3,) of the RGB reflectance; rgb (3,) is changed.
    """
    q, r = slopes
    o, d = origin, towards_slopes(m, q, r)
    share = 1.0
    for j in range(chain.count):
        t = abs(chain.facets[j]) - 1
        _, _, _, n0, n1, n2 = plane_of(surface, t)
        c = -dot((n0, n1, n2), d)
        ok, o, d = turned(surface, chain.facets[j], o, d)
        f, g = barycentric(surface, t, o)
        if not ok or min(f, g, 1.0 - f - g) < 0.0:
            return 0.0
        store_row(places, j, o)
        slot = surface.object_id[t]
        row = surface.rows[slot]
        slot_reflectance(surface, slot, t, o[0], o[1], o[2], rgb)
        tint = dot(vector(weights), vector(rgb))
        if row[KIND] == DIELECTRIC:
            eta = row[INDEX] if c > 0.0 else 1.0 / row[INDEX]
            reflected, _ = fresnel_dielectric(abs(c), eta)
            crossing = 1.0 - reflected if from_light else (1.0 - reflected) / (eta * eta)
            share *= tint * (crossing if chain.facets[j] > 0 else reflected)
        else:
            share *= eval_band(row[KIND], Lobes(1.0, abs(c), 0.0), tint, row[METAL_N], row[METAL_K], row[INTERNAL])
    return share


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pixel_on_way(
    view: View, tilt: Float, distorted: bool, height: int, p: Vector, a: float, b: float
) -> tuple[int, float]:
    """The pixel of a ray through lens point (a, b) that comes by p, -1 if none, and du dv / dq dr there."""
    x, y, area = lens_project(view, tilt, distorted, p[0], p[1], p[2], a, b)
    if not (area > 0.0 and -0.5 <= x < view.width - 0.5 and -0.5 <= y < height - 0.5):
        return -1, 0.0
    to, m = minus(p, lens_position(view, a, b)), view.T_world_camera
    distance = length(to)
    cosine = (m[0, 2] * to[0] + m[1, 2] * to[1] + m[2, 2] * to[2]) / distance
    return int(math.floor(y + 0.5)) * view.width + int(math.floor(x + 0.5)), area * distance**2 * cosine**3
