"""A path and the vertex it has reached, the same for paths from the laser and from the camera.

A wavefront is two arrays of records, VERTEX and PATH, row by row of the same paths; each kernel works on all rows.
`intersect` is the only one that knows meshes and textures, `scatter` draws the next ray; the kernels that connect read
the records. Normals are those of the winding, not turned towards anything: their side tells inside from outside for
glass.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float, Int
from render.laser_indirect.photon_emission import SEQUENCE
from render.material.bsdf import SUBSURFACE, eval_band, eval_lobes, is_specular_kind, pdf_lobes, sample
from render.sampling.random import uniform
from render.world.interior_list import bit_of, index_beside, medium_within
from render.world.surface_interaction import interaction
from render.world.triangles import Surface, off_surface, plane_of

Records = NDArray[np.void]
Record = Any
"""One of `Records`: numba reads its fields in place."""

VERTEX = np.dtype(
    [
        ("p", "f8", 3),  # point
        ("n", "f8", 3),  # geometric normal
        ("ns", "f8", 3),  # shading normal
        ("t", "f8", 3),  # tangent, of the shading frame
        ("wo", "f8", 3),  # direction back along the path, in the shading frame
        ("reflectance", "f8"),  # at the wavelength
        ("alpha", "f8", 2),  # roughness along and across the tangent
        ("index", "f8"),  # of refraction, over that of what is around
        ("material", "i4"),
        ("turbid", "i4"),  # sides on which light scatters: bits INNER, OUTER
    ],
    align=True,
)
PATH = np.dtype(
    [
        ("throughput", "f8"),  # of light paths their power, W; of camera paths their weight
        ("dvcm", "f8"),  # partial sums of the MIS weights (Georgiev et al. 2012, dVCM and dVC)
        ("dvc", "f8"),
        ("index", "i8"),  # number of the path
        ("interior", "i8"),  # the overlapping bodies that it is within (`render.world.interior_list`)
        ("pixel", "i4"),  # of camera paths
        ("kind", "i4"),  # of light: bits CAUSTIC, SUBSURFACE_LIGHT
        ("medium", "i4"),  # material of the medium it is in; -1: none
        ("fan_bin", "i4"),  # of light paths
        ("all_specular", "?"),  # no surface so far could be connected to the one before it (camera paths: to anything)
        ("after_specular", "?"),  # the last surface was specular
    ],
    align=True,
)
INTERREFLECTION, CAUSTIC, SUBSURFACE_LIGHT, SPECULAR_CHAIN = 0, 1, 2, 4
"""Kinds of light, as bits: none; through clear glass or off a mirror; through a medium; found by merging alone."""
INNER, OUTER = 1, 2
"""Sides of a surface, as bits: behind its shading normal, and before it."""
SURFACE = 11
"""Columns of a material's row that say how its surface scatters."""
MOST_BOUNCES = 64
ROULETTE_AFTER = 3
"""Surfaces met before Russian roulette may end a path."""
MOST_SURVIVAL = 0.95


class PassContext(NamedTuple):
    """What all kernels of a pass need: materials, random numbers, the light that is wanted, and how rays begin."""

    rows: Float
    """(materials, .) `render.material.bsdf`."""
    seed: int
    kinds: int
    """Of light that is wanted besides plain interreflection; paths of other kinds end."""
    centre: Float
    """(3,) that the ray engine's coordinates are relative to."""
    ray_epsilon: float
    """m, how far off a surface a ray begins."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def intersect(  # noqa: PLR0913
    surface: Surface,
    weights: Float,
    context: PassContext,
    depth: int,
    origin: Float,
    direction: Float,
    triangle: Int,
    paths: Records,
    vertices: Records,
) -> int:
    """Where rays (n, 3) hit their triangle (-1: none) -> vertices; paths are moved up to match. Returns their number.

    weights (3,): of the RGB reflectance at the wavelength. Takes the partial MIS sums from solid angle to area.
    """
    rgb, alpha, frame = np.empty(3), np.empty(2), np.empty((3, 3))
    hits = 0
    for r in range(triangle.shape[0]):
        t = triangle[r]
        if t < 0:
            continue
        a0, a1, a2, n0, n1, n2 = plane_of(surface, t)
        d0, d1, d2 = direction[r, 0], direction[r, 1], direction[r, 2]
        b0, b1, b2 = origin[r, 0], origin[r, 1], origin[r, 2]
        cosine = n0 * d0 + n1 * d1 + n2 * d2
        if cosine == 0.0:
            continue
        s = (n0 * (a0 - b0) + n1 * (a1 - b1) + n2 * (a2 - b2)) / cosine
        p0, p1, p2 = b0 + s * d0, b1 + s * d1, b2 + s * d2
        choice = uniform(context.seed, paths[r].index, depth, 3)
        material = interaction(surface, t, p0, p1, p2, n0, n1, n2, choice, rgb, alpha, frame)
        v = vertices[hits]
        v.p[0], v.p[1], v.p[2] = p0, p1, p2
        v.n[0], v.n[1], v.n[2] = n0, n1, n2
        for axis in range(3):
            v.ns[axis], v.t[axis] = frame[2, axis], frame[0, axis]
            v.wo[axis] = -(frame[axis, 0] * d0 + frame[axis, 1] * d1 + frame[axis, 2] * d2)
        # on one side of the facet and of the shading normal, or light from behind would leak through
        if v.wo[2] * cosine >= 0.0:
            continue
        v.material = material
        v.reflectance = weights[0] * rgb[0] + weights[1] * rgb[1] + weights[2] * rgb[2]
        v.alpha[0], v.alpha[1] = alpha[0], alpha[1]
        v.index = context.rows[material, 3]
        v.turbid = INNER if context.rows[material, 0] == SUBSURFACE else 0
        paths[hits] = paths[r]
        path = paths[hits]
        bit = bit_of(context.rows, material)
        if bit > 0 or path.interior > 0:
            set_surroundings(v, context.rows, path.interior & ~bit, bit)
        path.dvcm *= s * s / abs(cosine)
        path.dvc /= abs(cosine)
        hits += 1
    return hits


@numba.njit(nogil=True, cache=True, error_model="numpy")
def set_surroundings(v: Record, rows: Float, outside: int, bit: int) -> None:
    """What transparent bodies that overlap make of a vertex; outside: those that it is in, without its own (bit)."""
    beside = medium_within(rows, outside) >= 0
    if bit > 0:
        v.index /= index_beside(rows, outside)
        v.turbid |= OUTER if beside else 0
    elif beside:
        v.turbid |= OUTER if v.wo[2] > 0.0 else INNER


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def is_turbid(v: Record, cosine: float) -> bool:
    """Light that leaves a vertex under this cosine with its shading normal is scattered on its way."""
    return v.turbid & (INNER if cosine < 0.0 else OUTER) != 0


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def interior_beyond(v: Record, path: Record, rows: Float, cosine: float) -> int:
    """The overlapping bodies that a ray is within which leaves a vertex under this cosine with its normal."""
    bit = bit_of(rows, v.material)
    return path.interior & ~bit | (bit if cosine < 0.0 else 0)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def is_specular(v: Record, rows: Float) -> bool:
    """The BSDF at a vertex is a delta function: a mirror or clear glass."""
    return is_specular_kind(rows[v.material, 0], v.alpha[0], v.alpha[1])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_bsdf(v: Record, rows: Float, o0: float, o1: float, o2: float, i0: float, i1: float, i2: float) -> float:
    """f(wo, wi) at a vertex, 1/sr (`render.material.bsdf`)."""
    row = rows[v.material]
    facets, cosine, base = eval_lobes(row[0], v.alpha[0], v.alpha[1], v.index, o0, o1, o2, i0, i1, i2)
    return eval_band(row[0], facets, cosine, base, v.reflectance, row[4], row[7], row[10])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bsdf_pdf(v: Record, rows: Float, o0: float, o1: float, o2: float, i0: float, i1: float, i2: float) -> float:
    """pdf with which a vertex scatters a path from wo to wi, 1/sr (`render.material.bsdf`)."""
    row = rows[v.material]
    return pdf_lobes(row[0], v.alpha[0], v.alpha[1], v.index, v.reflectance, o0, o1, o2, i0, i1, i2)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bitangent(v: Record) -> tuple[float, float, float]:
    """Second axis of a vertex's shading frame: ns x t."""
    return (
        v.ns[1] * v.t[2] - v.ns[2] * v.t[1],
        v.ns[2] * v.t[0] - v.ns[0] * v.t[2],
        v.ns[0] * v.t[1] - v.ns[1] * v.t[0],
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def to_shading(v: Record, d0: float, d1: float, d2: float) -> tuple[float, float, float]:
    """A world direction in a vertex's shading frame."""
    y0, y1, y2 = bitangent(v)
    return (
        d0 * v.t[0] + d1 * v.t[1] + d2 * v.t[2],
        d0 * y0 + d1 * y1 + d2 * y2,
        d0 * v.ns[0] + d1 * v.ns[1] + d2 * v.ns[2],
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cosine_to(v: Record, d0: float, d1: float, d2: float) -> float:
    """Cosine of a world direction with a vertex's geometric normal."""
    return v.n[0] * d0 + v.n[1] * d1 + v.n[2] * d2


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def shading_normal_factor(v: Record) -> float:
    """|ns . wo| / |n . wo|: what a shading normal changes for light that arrives along wo (Veach 1997, eq. 5.20).

    The factor on  f |n . wi|  for light paths; 1 where both normals agree.
    """
    if v.ns[0] == v.n[0] and v.ns[1] == v.n[1] and v.ns[2] == v.n[2]:
        return 1.0
    y0, y1, y2 = bitangent(v)
    o0, o1, o2 = v.wo[0], v.wo[1], v.wo[2]
    geometric = (
        v.n[0] * (v.t[0] * o0 + y0 * o1 + v.ns[0] * o2)
        + v.n[1] * (v.t[1] * o0 + y1 * o1 + v.ns[1] * o2)
        + v.n[2] * (v.t[2] * o0 + y2 * o1 + v.ns[2] * o2)
    )
    return abs(o2 / geometric)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def scatter(
    vertices: Records,
    paths: Records,
    context: PassContext,
    depth: int,
    shift: Float,
    from_light: bool,
    origin: Float,
    direction: Float,
) -> int:
    """Draw each path's next ray -> origin, direction (n, 3); paths are moved up to match. Returns how many go on.

    shift (3,): where the sequences begin that decide a light path's first scattering; later ones are random. Radiance,
    which camera paths carry, changes with the square of the refractive index; power does not. Shading normals: Veach
    (1997), 5.3.
    """
    rows = context.rows
    rgb, row, i, f = np.empty(3), np.empty(SURFACE), np.empty(3), np.empty(1)
    going = 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        specular = is_specular(v, rows)
        choice, r1, r2 = bsdf_sample_numbers(path.index, depth, shift, from_light, context.seed)
        o0, o1, o2 = v.wo[0], v.wo[1], v.wo[2]
        if specular and not context.kinds & CAUSTIC:
            continue
        for c in range(SURFACE):
            row[c] = rows[v.material, c]
        row[1], row[2], row[3] = v.alpha[0], v.alpha[1], v.index
        rgb[0] = rgb[1] = rgb[2] = v.reflectance
        pdf = sample(row, rgb, o0, o1, o2, choice, r1, r2, i, f)
        if pdf == 0.0:
            continue
        y0, y1, y2 = bitangent(v)
        d0 = i[0] * v.t[0] + i[1] * y0 + i[2] * v.ns[0]
        d1 = i[0] * v.t[1] + i[1] * y1 + i[2] * v.ns[1]
        d2 = i[0] * v.t[2] + i[1] * y2 + i[2] * v.ns[2]
        out = cosine_to(v, d0, d1, d2)
        if out * i[2] <= 0.0:
            continue
        crosses = o2 * i[2] < 0.0
        kind = path.kind | CAUSTIC if specular else path.kind
        medium = v.material if row[0] == SUBSURFACE and i[2] < 0.0 else -1
        interior = interior_beyond(v, path, rows, i[2])
        if interior > 0:
            medium = medium_within(rows, interior)
        if crosses and (row[0] == SUBSURFACE or medium >= 0 or path.medium >= 0):
            # what comes out of a medium is left to the paths from the laser
            if not from_light or not context.kinds & SUBSURFACE_LIGHT:
                continue
            kind |= SUBSURFACE_LIGHT
        throughput = path.throughput * f[0]
        if from_light:
            throughput *= shading_normal_factor(v) * abs(out / i[2])
        elif crosses:
            throughput *= row[3] * row[3] if o2 < 0.0 else 1.0 / (row[3] * row[3])
        if depth >= ROULETTE_AFTER:
            survival = min(f[0], MOST_SURVIVAL)
            if uniform(context.seed, path.index, depth, 4) >= survival:
                continue
            throughput /= survival
        if throughput <= 0.0:
            continue
        cosine = abs(out)
        if specular:
            dvcm, dvc = 0.0, path.dvc * cosine
        else:
            reverse_pdf = bsdf_pdf(v, rows, i[0], i[1], i[2], o0, o1, o2)
            dvcm, dvc = 1.0 / pdf, cosine / pdf * (path.dvcm + reverse_pdf * path.dvc)
        origin[going, 0], origin[going, 1], origin[going, 2] = off_surface(
            v.p[0], v.p[1], v.p[2], v.n[0], v.n[1], v.n[2], context.ray_epsilon if out > 0.0 else -context.ray_epsilon
        )
        direction[going, 0], direction[going, 1], direction[going, 2] = d0, d1, d2
        all_specular = path.all_specular and (specular or (from_light and path.after_specular))
        paths[going] = paths[r]
        after = paths[going]
        after.throughput, after.dvcm, after.dvc = throughput, dvcm, dvc
        after.kind, after.medium, after.interior = kind, medium, interior
        after.all_specular, after.after_specular = all_specular, specular
        going += 1
    return going


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bsdf_sample_numbers(
    index: int, depth: int, shift: Float, from_light: bool, seed: int
) -> tuple[float, float, float]:
    """The lobe's and the direction's numbers in [0, 1): of a light path's first surface from its sequence."""
    if depth == 0 and from_light:
        return (
            (shift[0] + index * SEQUENCE[2]) % 1.0,
            (shift[1] + index * SEQUENCE[3]) % 1.0,
            (shift[2] + index * SEQUENCE[4]) % 1.0,
        )
    return uniform(seed, index, depth, 0), uniform(seed, index, depth, 1), uniform(seed, index, depth, 2)
