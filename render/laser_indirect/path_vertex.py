"""A path's meeting with a surface: one row of numbers, the same for paths from the laser and from the camera.

Each kernel here works on all rows of a wavefront at once. `interact` is the only one that knows meshes and textures;
the kernels that join and scatter read rows.

    vertex   0 point   3 geometric normal   6 shading normal   9 tangent   12 direction back along the path, local
             15 material   16 reflectance at the wavelength   17, 18 roughness along and across
    state    0 power or weight   1, 2 partial sums of the multiple-importance weights (Georgiev et al. 2012: dVCM, dVC)
             3 no surface so far could be joined to the one before it (camera: to anything)
             4 the last surface was a mirror or clear glass
             5 number of the path   6 index of its pixel, for paths from the camera
             7 kind of light, BENT + SUNK   8 material of the medium it is in, plus 1; 0: none
             9 part of the fan, for paths from the laser

Normals are those of the winding, not turned towards anything: their side tells inside from outside for glass.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.laser_indirect.photon_emission import SEQUENCE
from render.material.bsdf import SUBSURFACE, in_band, lobes, mirrors, sample, sampled
from render.sampling.random import uniform
from render.world.surface_interaction import interaction
from render.world.triangles import Surface

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]

POINT, NORMAL, SHADING, TANGENT, BACK, MATERIAL, REFLECTANCE, ALPHA = 0, 3, 6, 9, 12, 15, 16, 17
VERTEX = 19
POWER, DVCM, DVC, LONE, CLEAR, NUMBER, PIXEL, KIND, MEDIUM, PART = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
STATE = 10
PLAIN, BENT, SUNK, UNJOINED = 0, 1, 2, 4
"""Kinds of light: through clear glass or off a mirror, through a medium, and found by merging alone."""
SURFACE = 11
"""Columns of a material's row that say how its surface scatters."""
MOST_BOUNCES = 64
ROULETTE_AFTER = 3
"""Surfaces met before a path may be ended by chance."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def interact(
    surface: Surface,
    weights: Float,
    seed: int,
    depth: int,
    origin: Float,
    direction: Float,
    triangle: Int,
    state: Float,
    vertex: Float,
) -> int:
    """Where rays (n, 3) hit their triangle (-1: nothing) -> rows of vertex; state is moved up to match.

    Takes the densities in `state` from solid angle to area. Returns the number of rows.
    """
    rgb, alpha, frame = np.empty(3), np.empty(2), np.empty((3, 3))
    vertices, triangles = surface.vertices, surface.triangles
    hits = 0
    for r in range(triangle.shape[0]):
        t = triangle[r]
        if t < 0:
            continue
        ia, ib, ic = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a0, a1, a2 = vertices[ia, 0], vertices[ia, 1], vertices[ia, 2]
        ab0, ab1, ab2 = vertices[ib, 0] - a0, vertices[ib, 1] - a1, vertices[ib, 2] - a2
        ac0, ac1, ac2 = vertices[ic, 0] - a0, vertices[ic, 1] - a1, vertices[ic, 2] - a2
        n0, n1, n2 = ab1 * ac2 - ab2 * ac1, ab2 * ac0 - ab0 * ac2, ab0 * ac1 - ab1 * ac0
        length = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
        n0, n1, n2 = n0 / length, n1 / length, n2 / length
        d0, d1, d2 = direction[r, 0], direction[r, 1], direction[r, 2]
        b0, b1, b2 = origin[r, 0], origin[r, 1], origin[r, 2]
        cosine = n0 * d0 + n1 * d1 + n2 * d2
        if cosine == 0.0:
            continue
        s = (n0 * (a0 - b0) + n1 * (a1 - b1) + n2 * (a2 - b2)) / cosine
        p0, p1, p2 = b0 + s * d0, b1 + s * d1, b2 + s * d2
        number = int(state[r, NUMBER])
        slot = interaction(surface, t, p0, p1, p2, n0, n1, n2, uniform(seed, number, depth, 3), rgb, alpha, frame)
        v = vertex[hits]
        v[0], v[1], v[2] = p0, p1, p2
        v[NORMAL], v[NORMAL + 1], v[NORMAL + 2] = n0, n1, n2
        for axis in range(3):
            v[SHADING + axis], v[TANGENT + axis] = frame[2, axis], frame[0, axis]
            v[BACK + axis] = -(frame[axis, 0] * d0 + frame[axis, 1] * d1 + frame[axis, 2] * d2)
        # on one side of the facet and of the normal that is shaded, or light from behind would leak through
        if v[BACK + 2] * cosine >= 0.0:
            continue
        v[MATERIAL] = slot
        v[REFLECTANCE] = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
        v[ALPHA], v[ALPHA + 1] = alpha[0], alpha[1]
        to_area = s * s / abs(cosine)
        for c in range(STATE):
            state[hits, c] = state[r, c]
        state[hits, DVCM] *= to_area
        state[hits, DVC] /= abs(cosine)
        hits += 1
    return hits


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def mirror_at(v: Float, rows: Float) -> bool:
    """A vertex scatters into single directions only."""
    return mirrors(rows[int(v[MATERIAL]), 0], v[ALPHA], v[ALPHA + 1])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def scattered(v: Float, rows: Float, o0: float, o1: float, o2: float, i0: float, i1: float, i2: float) -> float:
    """f(o, i) at a vertex, 1/sr (`render.material.bsdf`)."""
    slot = int(v[MATERIAL])
    kind = rows[slot, 0]
    facets, cosine, base = lobes(kind, v[ALPHA], v[ALPHA + 1], rows[slot, 3], o0, o1, o2, i0, i1, i2)
    return in_band(kind, facets, cosine, base, v[REFLECTANCE], rows[slot, 4], rows[slot, 7], rows[slot, 10])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def chance(v: Float, rows: Float, o0: float, o1: float, o2: float, i0: float, i1: float, i2: float) -> float:
    """Density with which a vertex sends a path from o to i, 1/sr (`render.material.bsdf`)."""
    slot = int(v[MATERIAL])
    return sampled(rows[slot, 0], v[ALPHA], v[ALPHA + 1], rows[slot, 3], v[REFLECTANCE], o0, o1, o2, i0, i1, i2)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def local(v: Float, d0: float, d1: float, d2: float) -> tuple[float, float, float]:
    """A world direction in a vertex's frame."""
    z0, z1, z2, x0, x1, x2 = v[6], v[7], v[8], v[9], v[10], v[11]
    y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
    return d0 * x0 + d1 * x1 + d2 * x2, d0 * y0 + d1 * y1 + d2 * y2, d0 * z0 + d1 * z1 + d2 * z2


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def adjoint(v: Float) -> float:
    """What a shading normal changes for light that leaves by a direction (Veach 1997, eq. 5.20), cosines included.

    The factor on  f |cos with the geometric normal|  for light; 1 where both normals agree.
    """
    z0, z1, z2, x0, x1, x2 = v[6], v[7], v[8], v[9], v[10], v[11]
    if z0 == v[3] and z1 == v[4] and z2 == v[5]:
        return 1.0
    y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
    o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
    back = (
        v[3] * (x0 * o0 + y0 * o1 + z0 * o2)
        + v[4] * (x1 * o0 + y1 * o1 + z1 * o2)
        + v[5] * (x2 * o0 + y2 * o1 + z2 * o2)
    )
    return abs(o2 / back)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def scatter(
    vertex: Float,
    state: Float,
    rows: Float,
    seed: int,
    depth: int,
    first: Float,
    from_light: bool,
    kinds: int,
    surface_offset: float,
    origin: Float,
    direction: Float,
) -> int:
    """Draw each path's next ray -> origin, direction (n, 3); state is moved up to match. Returns how many go on.

    kinds: the light that is wanted; other paths end. first (3,): where the sequences start that decide light's first
    scattering; later ones are drawn. Radiance, which paths from the camera carry, changes with the square of the
    refractive index; power does not. Shading normals: Veach (1997), 5.3.
    """
    rgb, row, i, f = np.empty(3), np.empty(SURFACE), np.empty(3), np.empty(1)
    going = 0
    for r in range(vertex.shape[0]):
        v = vertex[r]
        smooth = mirror_at(v, rows)
        number = int(state[r, NUMBER])
        if depth == 0 and from_light:
            choice = (first[0] + number * SEQUENCE[2]) % 1.0
            r1, r2 = (first[1] + number * SEQUENCE[3]) % 1.0, (first[2] + number * SEQUENCE[4]) % 1.0
        else:
            choice = uniform(seed, number, depth, 0)
            r1, r2 = uniform(seed, number, depth, 1), uniform(seed, number, depth, 2)
        o0, o1, o2 = v[BACK], v[BACK + 1], v[BACK + 2]
        if smooth and not kinds & BENT:
            continue
        slot = int(v[MATERIAL])
        for c in range(SURFACE):
            row[c] = rows[slot, c]
        row[1], row[2] = v[ALPHA], v[ALPHA + 1]
        rgb[0] = rgb[1] = rgb[2] = v[REFLECTANCE]
        density = sample(row, rgb, o0, o1, o2, choice, r1, r2, i, f)
        if density == 0.0:
            continue
        z0, z1, z2, x0, x1, x2 = v[6], v[7], v[8], v[9], v[10], v[11]
        y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
        d0 = i[0] * x0 + i[1] * y0 + i[2] * z0
        d1 = i[0] * x1 + i[1] * y1 + i[2] * z1
        d2 = i[0] * x2 + i[1] * y2 + i[2] * z2
        out = v[3] * d0 + v[4] * d1 + v[5] * d2
        if out * i[2] <= 0.0:
            continue
        kind, medium = int(state[r, KIND]), 0.0
        if smooth:
            kind |= BENT
        if row[0] == SUBSURFACE:
            if o2 * i[2] < 0.0:
                # what comes out of a medium is left to the paths from the laser
                if not from_light or not kinds & SUNK:
                    continue
                kind |= SUNK
            medium = v[MATERIAL] + 1.0 if i[2] < 0.0 else 0.0
        power = state[r, POWER] * f[0]
        if from_light:
            power *= adjoint(v) * abs(out / i[2])
        elif o2 * i[2] < 0.0:
            power *= row[3] * row[3] if o2 < 0.0 else 1.0 / (row[3] * row[3])
        if depth >= ROULETTE_AFTER:
            stay = min(f[0], 0.95)
            if uniform(seed, number, depth, 4) >= stay:
                continue
            power /= stay
        if power <= 0.0:
            continue
        cosine = abs(out)
        dvcm, dvc = state[r, DVCM], state[r, DVC]
        if smooth:
            dvcm, dvc = 0.0, dvc * cosine
        else:
            reverse = chance(v, rows, i[0], i[1], i[2], o0, o1, o2)
            dvcm, dvc = 1.0 / density, cosine / density * (dvcm + reverse * dvc)
        side = surface_offset if out > 0.0 else -surface_offset
        origin[going, 0], origin[going, 1], origin[going, 2] = (
            v[0] + side * v[3],
            v[1] + side * v[4],
            v[2] + side * v[5],
        )
        direction[going, 0], direction[going, 1], direction[going, 2] = d0, d1, d2
        lone = state[r, LONE] != 0.0 and (smooth or (from_light and state[r, CLEAR] != 0.0))
        state[going, POWER], state[going, DVCM], state[going, DVC] = power, dvcm, dvc
        state[going, LONE], state[going, CLEAR] = 1.0 if lone else 0.0, 1.0 if smooth else 0.0
        state[going, NUMBER], state[going, PIXEL] = number, state[r, PIXEL]
        state[going, KIND], state[going, MEDIUM] = kind, medium
        state[going, PART] = state[r, PART]
        going += 1
    return going
