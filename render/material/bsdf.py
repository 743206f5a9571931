"""BSDFs: evaluate, pdf and sample, dispatched to the material's model; each model has a file beside this one.

Local frame: z is the normal. wo is the direction that a path comes from, wi the one it goes on to; both point away from
the surface. A material is a row of numbers (`render.material.record`). Beside it comes rgb, its reflectance at the
point for each band: of the diffuse lobe, or the tint of the specular one.

LAMBERTIAN, CONDUCTOR, COATED and EMITTER are two-sided: light on either side is scattered alike and none is
transmitted; an EMITTER emits to z > 0 only. The boundaries, DIELECTRIC and SUBSURFACE, are one-sided: z points out of
the substance, so the frame must be built on the mesh's own normal, not on the one that faces the ray. The random walk
between two boundaries of a SUBSURFACE is the integrator's.

`evaluate` consists of what is common to all bands (`eval_lobes`) and of what differs (`eval_band`), so that a path at
one wavelength evaluates one band only. Both, and `pdf_lobes`, take single numbers of the row, since the roughness may
come from an image instead.
"""

from __future__ import annotations

import numba

from render.base.arrays import Float
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
from render.material.scattering import Lobes, Microsurface

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
def evaluate(  # noqa: PLR0913
    row: Float, rgb: Float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float, f: Float
) -> None:
    """f(wo, wi) in 1/sr, without the cosine -> f (3,) for each band; 0 for delta functions."""
    specular, cosine, diffuse = eval_lobes(row[KIND], row[ALPHA_X], row[ALPHA_Y], row[INDEX], ox, oy, oz, ix, iy, iz)
    for band in range(f.shape[0]):
        n, k = row[METAL_N + band], row[METAL_K + band]
        f[band] = eval_band(row[KIND], specular, cosine, diffuse, rgb[band], n, k, row[INTERNAL])


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def eval_lobes(  # noqa: PLR0913
    kind: float, ax: float, ay: float, eta: float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float
) -> Lobes:
    """The factors of f(wo, wi) that are common to all bands."""
    if oz == 0.0 or iz == 0.0 or is_specular_kind(kind, ax, ay):
        return Lobes(0.0, 0.0, 0.0)
    m = Microsurface(ax, ay, eta)
    if kind in (DIELECTRIC, SUBSURFACE):
        return dielectric.evaluate(m, (ox, oy, oz), (ix, iy, iz))
    if oz * iz < 0.0:
        return Lobes(0.0, 0.0, 0.0)
    wo, wi = (ox, oy, abs(oz)), (ix, iy, abs(iz))
    if kind == CONDUCTOR:
        return conductor.evaluate(m, wo, wi)
    if kind == COATED:
        return coated.evaluate(m, wo, wi)
    return lambertian.evaluate(wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_band(
    kind: float, specular: float, cosine: float, diffuse: float, reflectance: float, n: float, k: float, internal: float
) -> float:
    """f(wo, wi) in one band, 1/sr, from the lobes that `eval_lobes` returned."""
    lobes = Lobes(specular, cosine, diffuse)
    if kind == CONDUCTOR:
        return conductor.evaluate_band(lobes, reflectance, n, k)
    if kind == COATED:
        return coated.evaluate_band(lobes, reflectance, internal)
    return reflectance * (specular + diffuse)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(row: Float, rgb: Float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float) -> float:
    """pdf of `sample` for wi given wo, 1/sr; 0 for delta functions."""
    mean = (rgb[0] + rgb[1] + rgb[2]) / 3.0
    return pdf_lobes(row[KIND], row[ALPHA_X], row[ALPHA_Y], row[INDEX], mean, ox, oy, oz, ix, iy, iz)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf_lobes(  # noqa: PLR0913
    kind: float,
    ax: float,
    ay: float,
    index: float,
    reflectance: float,
    ox: float,
    oy: float,
    oz: float,
    ix: float,
    iy: float,
    iz: float,
) -> float:
    """pdf of `sample`, 1/sr, from single numbers of the row; reflectance: the mean over the bands."""
    if oz == 0.0 or iz == 0.0 or is_specular_kind(kind, ax, ay):
        return 0.0
    m = Microsurface(ax, ay, index)
    if kind in (DIELECTRIC, SUBSURFACE):
        return dielectric.pdf(m, (ox, oy, oz), (ix, iy, iz))
    if oz * iz < 0.0:
        return 0.0
    wo, wi = (ox, oy, abs(oz)), (ix, iy, abs(iz))
    if kind == CONDUCTOR:
        return conductor.pdf(m, wo, wi)
    if kind == COATED:
        return coated.pdf(m, reflectance, wo, wi)
    return lambertian.pdf(wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(  # noqa: PLR0913
    row: Float,
    rgb: Float,
    ox: float,
    oy: float,
    oz: float,
    choice: float,
    r1: float,
    r2: float,
    wi: Float,
    weight: Float,
) -> float:
    """Draw wi given wo -> wi (3,), weight (3,) or (1,) = f |cos wi| / pdf for each band.

    choice selects the lobe, r1 and r2 the direction in it; all in [0, 1). Returns the pdf, 1/sr; -1 for a delta
    function (the weight then includes its probability); 0 if nothing is scattered.
    """
    for band in range(weight.shape[0]):
        weight[band] = 0.0
    if oz == 0.0:
        return 0.0
    kind, m, numbers = row[KIND], Microsurface(row[ALPHA_X], row[ALPHA_Y], row[INDEX]), (choice, r1, r2)
    specular, wo = is_specular_row(row), (ox, oy, abs(oz))
    if is_boundary(row):
        drawn = dielectric.sample(m, specular, (ox, oy, oz), numbers)
    elif kind == CONDUCTOR:
        drawn = conductor.sample(m, specular, wo, numbers)
    elif kind == COATED:
        drawn = coated.sample(m, (rgb[0] + rgb[1] + rgb[2]) / 3.0, wo, numbers)
    else:
        drawn = lambertian.sample(numbers)
    if drawn.pdf == 0.0:
        return 0.0
    wi[0], wi[1], wi[2] = drawn.wi
    if oz < 0.0 and not is_boundary(row):
        wi[2] = -wi[2]
    lobes = drawn.lobes
    for band in range(weight.shape[0]):
        n, k, internal = row[METAL_N + band], row[METAL_K + band], row[INTERNAL]
        weight[band] = drawn.factor * eval_band(
            kind, lobes.specular, lobes.cosine, lobes.diffuse, rgb[band], n, k, internal
        )
    return drawn.pdf
