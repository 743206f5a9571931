"""BSDFs: evaluate, pdf and sample, dispatched to the material's model; each model has a file beside this one.

Local frame: z is the normal. wo is the direction that a path comes from, wi the one it goes on to; both point away from
the surface. A material is a row of numbers (`render.material.record`). Beside it comes rgb, its reflectance at the
point for each band: of the diffuse lobe, or the tint of the specular one.

LAMBERTIAN, CONDUCTOR, COATED and EMITTER are two-sided: light on either side is scattered alike and none is
transmitted; an EMITTER emits to z > 0 only. The boundaries, DIELECTRIC and SUBSURFACE, are one-sided: z points out of
the substance, so the frame must be built on the mesh's own normal, not on the one that faces the ray. The random walk
between two boundaries of a SUBSURFACE is the integrator's.

`evaluate` consists of what is common to all bands (`eval_lobes`) and of what differs (`eval_band`), so that a path at
one wavelength evaluates one band only. Both, and `pdf_lobes`, take the roughness apart from the row, since it may come
from an image instead.
"""

from __future__ import annotations

import numba

from render.base.arrays import Float
from render.base.vectors import Vector
from render.material import coated, conductor, dielectric, lambertian
from render.material.record import (
    ALPHA_X,
    ALPHA_Y,
    ANISOTROPY,
    COATED,
    CONDUCTOR,
    DIELECTRIC,
    EMITTED,
    EMITTER,
    EXTINCTION,
    INDEX,
    INTERNAL,
    KIND,
    LAMBERTIAN,
    METAL_K,
    METAL_N,
    ROW,
    SCATTERED,
    SPECULAR_ROUGHNESS,
    SUBSURFACE,
)
from render.material.scattering import Direction, Lobes, Microsurface, Numbers

__all__ = [
    "ANISOTROPY",
    "COATED",
    "CONDUCTOR",
    "DIELECTRIC",
    "EMITTED",
    "EMITTER",
    "EXTINCTION",
    "LAMBERTIAN",
    "ROW",
    "SCATTERED",
    "SPECULAR_ROUGHNESS",
    "SUBSURFACE",
    "eval_band",
    "eval_lobes",
    "evaluate",
    "is_boundary",
    "is_diffuse",
    "is_specular_kind",
    "is_specular_row",
    "pdf",
    "pdf_lobes",
    "sample",
]


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_diffuse(row: Float) -> bool:
    """The BSDF is Lambertian."""
    return row[KIND] == LAMBERTIAN or row[KIND] == EMITTER


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_boundary(row: Float) -> bool:
    """The surface transmits light, so z must point out of the substance."""
    return row[KIND] == DIELECTRIC or row[KIND] == SUBSURFACE


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_specular_row(row: Float) -> bool:
    """The BSDF is a sum of delta functions."""
    return is_specular_kind(row[KIND], row[ALPHA_X], row[ALPHA_Y])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_specular_kind(kind: float, ax: float, ay: float) -> bool:
    """The BSDF of a material of this kind and roughness is a sum of delta functions."""
    return kind in (CONDUCTOR, DIELECTRIC) and max(ax, ay) < SPECULAR_ROUGHNESS


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(row: Float, rgb: Vector, wo: Direction, wi: Direction) -> Vector:
    """f(wo, wi) in each of 3 bands, 1/sr, without the cosine; 0 for delta functions."""
    kind, lobes, internal = row[KIND], eval_lobes(row[KIND], microsurface(row), wo, wi), row[INTERNAL]
    return (
        eval_band(kind, lobes, rgb[0], row[METAL_N], row[METAL_K], internal),
        eval_band(kind, lobes, rgb[1], row[METAL_N + 1], row[METAL_K + 1], internal),
        eval_band(kind, lobes, rgb[2], row[METAL_N + 2], row[METAL_K + 2], internal),
    )


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def microsurface(row: Float) -> Microsurface:
    """Roughness and refractive index of a row."""
    return Microsurface(row[ALPHA_X], row[ALPHA_Y], row[INDEX])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_lobes(kind: float, m: Microsurface, wo: Direction, wi: Direction) -> Lobes:
    """The factors of f(wo, wi) that are common to all bands."""
    if wo[2] == 0.0 or wi[2] == 0.0 or is_specular_kind(kind, m.alpha_x, m.alpha_y):
        return Lobes(0.0, 0.0, 0.0)
    if kind in (DIELECTRIC, SUBSURFACE):
        return dielectric.evaluate(m, wo, wi)
    if wo[2] * wi[2] < 0.0:
        return Lobes(0.0, 0.0, 0.0)
    wo, wi = (wo[0], wo[1], abs(wo[2])), (wi[0], wi[1], abs(wi[2]))
    if kind == CONDUCTOR:
        return conductor.evaluate(m, wo, wi)
    if kind == COATED:
        return coated.evaluate(m, wo, wi)
    return lambertian.evaluate(wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_band(kind: float, lobes: Lobes, reflectance: float, n: float, k: float, internal: float) -> float:
    """f(wo, wi) in one band, 1/sr, from the lobes that `eval_lobes` returned."""
    if kind == CONDUCTOR:
        return conductor.evaluate_band(lobes, reflectance, n, k)
    if kind == COATED:
        return coated.evaluate_band(lobes, reflectance, internal)
    return reflectance * (lobes.specular + lobes.diffuse)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(row: Float, rgb: Vector, wo: Direction, wi: Direction) -> float:
    """pdf of `sample` for wi given wo, 1/sr; 0 for delta functions."""
    return pdf_lobes(row[KIND], microsurface(row), (rgb[0] + rgb[1] + rgb[2]) / 3.0, wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf_lobes(kind: float, m: Microsurface, reflectance: float, wo: Direction, wi: Direction) -> float:
    """pdf of `sample`, 1/sr, with the roughness apart from the row; reflectance: the mean over the bands."""
    if wo[2] == 0.0 or wi[2] == 0.0 or is_specular_kind(kind, m.alpha_x, m.alpha_y):
        return 0.0
    if kind in (DIELECTRIC, SUBSURFACE):
        return dielectric.pdf(m, wo, wi)
    if wo[2] * wi[2] < 0.0:
        return 0.0
    wo, wi = (wo[0], wo[1], abs(wo[2])), (wi[0], wi[1], abs(wi[2]))
    if kind == CONDUCTOR:
        return conductor.pdf(m, wo, wi)
    if kind == COATED:
        return coated.pdf(m, reflectance, wo, wi)
    return lambertian.pdf(wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(row: Float, rgb: Vector, wo: Direction, numbers: Numbers, weight: Float) -> tuple[Direction, float]:
    """Draw wi given wo: wi and its pdf, 1/sr; -> weight (3,) or (1,) = f |cos wi| / pdf for each band.

    numbers, in [0, 1): the first selects the lobe, the others the direction in it. The pdf is -1 for a delta function
    (the weight then includes its probability), and 0 if nothing is scattered.
    """
    for band in range(weight.shape[0]):
        weight[band] = 0.0
    if wo[2] == 0.0:
        return (0.0, 0.0, 0.0), 0.0
    kind, m, specular = row[KIND], microsurface(row), is_specular_row(row)
    above = wo[0], wo[1], abs(wo[2])
    if is_boundary(row):
        drawn = dielectric.sample(m, specular, wo, numbers)
    elif kind == CONDUCTOR:
        drawn = conductor.sample(m, specular, above, numbers)
    elif kind == COATED:
        drawn = coated.sample(m, (rgb[0] + rgb[1] + rgb[2]) / 3.0, above, numbers)
    else:
        drawn = lambertian.sample(numbers)
    if drawn.pdf == 0.0:
        return (0.0, 0.0, 0.0), 0.0
    for band in range(weight.shape[0]):
        n, k = row[METAL_N + band], row[METAL_K + band]
        weight[band] = drawn.factor * eval_band(kind, drawn.lobes, rgb[band], n, k, row[INTERNAL])
    x, y, z = drawn.wi
    return (x, y, -z if wo[2] < 0.0 and not is_boundary(row) else z), drawn.pdf
