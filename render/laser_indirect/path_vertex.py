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
from render.base.borrowed import borrowed
from render.base.vectors import (
    Vector,
    along,
    cross,
    dot,
    minus,
    negative,
    plus,
    rotated,
    row_vector,
    scaled,
    store,
    store_row,
    vector,
)
from render.laser_indirect.photon_emission import SEQUENCE
from render.material.bsdf import SUBSURFACE, eval_band, eval_lobes, is_specular_kind, pdf_lobes, sample
from render.material.record import ALPHA_X, ALPHA_Y, BSDF_COLUMNS, INDEX, INTERNAL, KIND, METAL_K, METAL_N
from render.material.scattering import Microsurface, Numbers
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
        ("triangle", "i4"),  # that it has reached
        ("count", "i4"),  # of `facets`; -1: too many, or other surfaces as well
        ("facets", "i4", 4),  # 1 + the triangles that have refracted it since it began, minus those that have reflected
        ("all_specular", "?"),  # no surface so far could be connected to the one before it (camera paths: to anything)
        ("after_specular", "?"),  # the last surface was specular
        ("walked", "?"),  # the chain that it has come over is listed here (`render.laser_indirect.specular_chains`)
    ],
    align=True,
)
INTERREFLECTION, CAUSTIC, SUBSURFACE_LIGHT, SPECULAR_CHAIN = 0, 1, 2, 4
"""Kinds of light, as bits: none; through clear glass or off a mirror; through a medium; found by walks or merging."""
ALL_KINDS = CAUSTIC | SUBSURFACE_LIGHT | SPECULAR_CHAIN
INNER, OUTER = 1, 2
"""Sides of a surface, as bits: behind its shading normal, and before it."""
MOST_BOUNCES = 64
MOST_FACETS = 4
"""Of the mirrors and faces of glass at a path's beginning that are remembered: `facets` of PATH."""
FIRST_ROULETTE_SURFACE = 4
"""Surface, counted from 1, on leaving which a path may first be ended by Russian roulette."""
MOST_SURVIVAL = 0.95
"""Largest probability of surviving it, so that paths among mirrors end. Chosen, not tuned."""


class PassContext(NamedTuple):
    """What all kernels of a pass need: materials, random numbers, the light that is wanted, and how rays begin."""

    rows: Float
    """(materials, .) `render.material.bsdf`."""
    weights: Float
    """(3,) of the RGB reflectance at the wavelength."""
    seed: int
    kinds: int
    """Of light that is wanted besides plain interreflection; paths of other kinds end."""
    centre: Float
    """(3,) that the ray engine's coordinates are relative to."""
    ray_epsilon: float
    """m, how far off a surface a ray begins."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def intersect(
    surface: Surface,
    context: PassContext,
    depth: int,
    origin: Float,
    direction: Float,
    triangle: Int,
    paths: Records,
    vertices: Records,
) -> int:
    """Where rays (n, 3) hit their triangle (-1: none) -> vertices; paths are moved up to match. Returns their number.

    Takes the partial MIS sums from solid angle to area.
    """
    surface, context, origin = borrowed(surface), borrowed(context), borrowed(origin)
    direction, triangle, paths = borrowed(direction), borrowed(triangle), borrowed(paths)
    vertices = borrowed(vertices)
    rgb, alpha, frame = np.empty(3), np.empty(2), np.empty((3, 3))
    hits = 0
    for r in range(triangle.shape[0]):
        t = triangle[r]
        if t < 0:
            continue
        a0, a1, a2, n0, n1, n2 = plane_of(surface, t)
        start, d, normal = row_vector(origin, r), row_vector(direction, r), (n0, n1, n2)
        cosine = dot(normal, d)
        if cosine == 0.0:
            continue
        s = dot(normal, minus((a0, a1, a2), start)) / cosine
        point = along(start, s, d)
        choice = uniform(context.seed, paths[r].index, depth, 3)
        material = interaction(surface, t, point, normal, choice, rgb, alpha, frame)
        v = vertices[hits]
        store(v.p, point)
        store(v.n, normal)
        store(v.ns, row_vector(frame, 2))
        store(v.t, row_vector(frame, 0))
        store(v.wo, negative(rotated(frame, d)))
        # on one side of the facet and of the shading normal, or light from behind would leak through
        if v.wo[2] * cosine >= 0.0:
            continue
        v.material = material
        v.reflectance = dot(vector(context.weights), vector(rgb))
        v.alpha[0], v.alpha[1] = alpha[0], alpha[1]
        v.index = context.rows[material, INDEX]
        v.turbid = INNER if context.rows[material, KIND] == SUBSURFACE else 0
        paths[hits] = paths[r]
        path = paths[hits]
        path.triangle, path.walked = t, False
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
    return is_specular_kind(rows[v.material, KIND], v.alpha[0], v.alpha[1])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_bsdf(v: Record, rows: Float, wo: Vector, wi: Vector) -> float:
    """f(wo, wi) at a vertex, 1/sr (`render.material.bsdf`)."""
    row = rows[v.material]
    lobes = eval_lobes(row[KIND], Microsurface(v.alpha[0], v.alpha[1], v.index), wo, wi)
    return eval_band(row[KIND], lobes, v.reflectance, row[METAL_N], row[METAL_K], row[INTERNAL])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bsdf_pdf(v: Record, rows: Float, wo: Vector, wi: Vector) -> float:
    """pdf with which a vertex scatters a path from wo to wi, 1/sr (`render.material.bsdf`)."""
    m = Microsurface(v.alpha[0], v.alpha[1], v.index)
    return pdf_lobes(rows[v.material, KIND], m, v.reflectance, wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bitangent(v: Record) -> Vector:
    """Second axis of a vertex's shading frame: ns x t."""
    return cross(vector(v.ns), vector(v.t))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def to_shading(v: Record, d: Vector) -> Vector:
    """A world direction in a vertex's shading frame."""
    return dot(d, vector(v.t)), dot(d, bitangent(v)), dot(d, vector(v.ns))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def from_shading(v: Record, d: Vector) -> Vector:
    """A direction in a vertex's shading frame in the world."""
    return plus(plus(scaled(d[0], vector(v.t)), scaled(d[1], bitangent(v))), scaled(d[2], vector(v.ns)))


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def cosine_to(v: Record, d: Vector) -> float:
    """Cosine of a world direction with a vertex's geometric normal."""
    return dot(vector(v.n), d)


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def shading_normal_factor(v: Record) -> float:
    """|ns . wo| / |n . wo|: what a shading normal changes for light that arrives along wo (Veach 1997, eq. 5.20).

    The factor on  f |n . wi|  for light paths; 1 where both normals agree.
    """
    if v.ns[0] == v.n[0] and v.ns[1] == v.n[1] and v.ns[2] == v.n[2]:
        return 1.0
    return abs(v.wo[2] / cosine_to(v, from_shading(v, vector(v.wo))))


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
    vertices, paths, context, shift = borrowed(vertices), borrowed(paths), borrowed(context), borrowed(shift)
    origin, direction = borrowed(origin), borrowed(direction)
    rows = context.rows
    row, f = np.empty(BSDF_COLUMNS), np.empty(1)
    going = 0
    for r in range(vertices.shape[0]):
        v, path = vertices[r], paths[r]
        specular = is_specular(v, rows)
        if specular and not context.kinds & CAUSTIC:
            continue
        numbers = bsdf_sample_numbers(path.index, depth, shift, from_light, context.seed)
        for c in range(BSDF_COLUMNS):
            row[c] = rows[v.material, c]
        row[ALPHA_X], row[ALPHA_Y], row[INDEX] = v.alpha[0], v.alpha[1], v.index
        rgb = v.reflectance, v.reflectance, v.reflectance
        wo = vector(v.wo)
        wi, pdf = sample(row, rgb, wo, numbers, f)
        if pdf == 0.0:
            continue
        d = from_shading(v, wi)
        cosine = cosine_to(v, d)
        if cosine * wi[2] <= 0.0:
            continue
        crosses = wo[2] * wi[2] < 0.0
        kind = path.kind | CAUSTIC if specular else path.kind
        medium = v.material if row[KIND] == SUBSURFACE and wi[2] < 0.0 else -1
        interior = interior_beyond(v, path, rows, wi[2])
        if interior > 0:
            medium = medium_within(rows, interior)
        if crosses and (row[KIND] == SUBSURFACE or medium >= 0 or path.medium >= 0):
            # what comes out of a medium is left to the paths from the laser
            if not from_light or not context.kinds & SUBSURFACE_LIGHT:
                continue
            kind |= SUBSURFACE_LIGHT
        throughput = path.throughput * f[0]
        if from_light:
            throughput *= shading_normal_factor(v) * abs(cosine / wi[2])
        elif crosses:
            throughput *= row[INDEX] * row[INDEX] if wo[2] < 0.0 else 1.0 / (row[INDEX] * row[INDEX])
        if depth + 1 >= FIRST_ROULETTE_SURFACE:
            survival = min(f[0], MOST_SURVIVAL)
            if uniform(context.seed, path.index, depth, 4) >= survival:
                continue
            throughput /= survival
        if throughput <= 0.0:
            continue
        if specular:
            dvcm, dvc = 0.0, path.dvc * abs(cosine)
        else:
            reverse_pdf = bsdf_pdf(v, rows, wi, wo)
            dvcm, dvc = 1.0 / pdf, abs(cosine) / pdf * (path.dvcm + reverse_pdf * path.dvc)
        side = context.ray_epsilon if cosine > 0.0 else -context.ray_epsilon
        store_row(origin, going, off_surface(vector(v.p), vector(v.n), side))
        store_row(direction, going, d)
        all_specular = path.all_specular and (specular or (from_light and path.after_specular))
        paths[going] = paths[r]
        after = paths[going]
        after.throughput, after.dvcm, after.dvc = throughput, dvcm, dvc
        after.kind, after.medium, after.interior = kind, medium, interior
        after.all_specular, after.after_specular = all_specular, specular
        remember(after, specular, crosses)
        going += 1
    return going


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def remember(path: Record, specular: bool, crosses: bool) -> None:
    """Add the triangle that a path has reached to its `facets`, if it goes on from there in one direction alone."""
    if not specular or path.count == MOST_FACETS:
        path.count = -1
    if path.count >= 0:
        path.facets[path.count] = 1 + path.triangle if crosses else -1 - path.triangle
        path.count += 1


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def bsdf_sample_numbers(index: int, depth: int, shift: Float, from_light: bool, seed: int) -> Numbers:
    """The lobe's and the direction's numbers in [0, 1): of a light path's first surface from its sequence."""
    if depth == 0 and from_light:
        return (
            (shift[0] + index * SEQUENCE[2]) % 1.0,
            (shift[1] + index * SEQUENCE[3]) % 1.0,
            (shift[2] + index * SEQUENCE[4]) % 1.0,
        )
    return uniform(seed, index, depth, 0), uniform(seed, index, depth, 1), uniform(seed, index, depth, 2)
