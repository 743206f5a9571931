"""How surfaces scatter: one evaluate, one density and one sampling routine over all materials.

Local frame: z is the normal. `o` is the direction light is followed back along or the one it comes from, `i` the other;
both point away from the surface. A material is one row of numbers, the reflectance at the point comes with it:

    row   0 kind   1 alpha x   2 alpha y   3 index of refraction   4.. n of each band   7.. k of each band
          10 internal diffuse reflectance of a coat   11 anisotropy g of a medium   12.. extinction of each band, 1/m
          15.. single-scattering albedo of each band   18.. emitted radiance, RGB whatever the bands, W/(m^2 sr)
    rgb   reflectance of the diffuse part, or the tint of the specular one, for each band

Two-sided are LAMBERTIAN, CONDUCTOR, COATED and EMITTER: light on either side is treated alike and none passes; an
EMITTER shines to z > 0 only. One-sided are the boundaries, DIELECTRIC and SUBSURFACE: z points out of the substance,
so the frame must be built on the mesh's own normal, not on the one turned towards the ray. SUBSURFACE scatters at its
boundary as rough DIELECTRIC; what happens between two boundaries is the integrator's.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

from render.material.fresnel import conductor, dielectric
from render.material.microfacet import density, sample_normal, smith_lambda, visible_density

Array = NDArray[np.float64]

LAMBERTIAN, CONDUCTOR, DIELECTRIC, COATED, SUBSURFACE, EMITTER = 0.0, 1.0, 2.0, 3.0, 4.0, 5.0
ANISOTROPY, EXTINCTION, SCATTERED, EMITTED = 11, 12, 15, 18
ROW = 21
SPECULAR_ROUGHNESS = 1e-4
"""Below this roughness a boundary is a mirror: its density is a delta function."""


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_diffuse(row: Array) -> bool:
    """The material scatters as Lambert says."""
    return row[0] == LAMBERTIAN or row[0] == EMITTER


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_boundary(row: Array) -> bool:
    """Light passes through; z must point out of the substance."""
    return row[0] == DIELECTRIC or row[0] == SUBSURFACE


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_specular_row(row: Array) -> bool:
    """The material scatters into single directions only."""
    return is_specular_kind(row[0], row[1], row[2])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def is_specular_kind(kind: float, ax: float, ay: float) -> bool:
    """A boundary or metal of this roughness scatters into single directions only."""
    return kind in (CONDUCTOR, DIELECTRIC) and max(ax, ay) < SPECULAR_ROUGHNESS


@numba.njit(nogil=True, cache=True, error_model="numpy")
def specular_share(eta: float, reflectance: float, cosine: float) -> float:
    """Probability with which a coat's reflection is sampled rather than its base."""
    reflected, _ = dielectric(cosine, eta)
    base = (1.0 - reflected) * reflectance
    return reflected / (reflected + base) if reflected + base > 0.0 else 1.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(  # noqa: PLR0913
    row: Array, rgb: Array, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float, f: Array
) -> None:
    """f(o, i) in 1/sr, without the cosine -> f (3,) for each band; 0 for the delta parts."""
    facets, cosine, base = eval_lobes(row[0], row[1], row[2], row[3], ox, oy, oz, ix, iy, iz)
    for band in range(f.shape[0]):
        f[band] = eval_band(row[0], facets, cosine, base, rgb[band], row[4 + band], row[7 + band], row[10])


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_lobes(  # noqa: PLR0913
    kind: float, ax: float, ay: float, eta: float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float
) -> tuple[float, float, float]:
    """What of f(o, i) is alike in all bands: facets, 1/sr, their cosine with o, and the diffuse base, 1/sr."""
    if oz == 0.0 or iz == 0.0 or is_specular_kind(kind, ax, ay):
        return 0.0, 0.0, 0.0
    if kind in (DIELECTRIC, SUBSURFACE):
        return rough_dielectric(eta, ax, ay, ox, oy, oz, ix, iy, iz), 0.0, 0.0
    if oz * iz < 0.0:
        return 0.0, 0.0, 0.0
    oz, iz = abs(oz), abs(iz)
    if kind in (LAMBERTIAN, EMITTER):
        return 0.0, 0.0, 1.0 / math.pi
    hx, hy, hz = ox + ix, oy + iy, oz + iz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx / length, hy / length, hz / length
    cosine = ox * hx + oy * hy + oz * hz
    shadowed = 1.0 + smith_lambda(ox, oy, oz, ax, ay) + smith_lambda(ix, iy, iz, ax, ay)
    facets = density(hx, hy, hz, ax, ay) / (4.0 * oz * iz * shadowed)
    if kind == CONDUCTOR:
        return facets, cosine, 0.0
    # coat: its own reflection, and the base seen through it twice
    coat, _ = dielectric(cosine, eta)
    enters, _ = dielectric(iz, eta)
    leaves, _ = dielectric(oz, eta)
    return coat * facets, cosine, (1.0 - enters) * (1.0 - leaves) / (eta * eta * math.pi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def eval_band(
    kind: float, facets: float, cosine: float, base: float, reflectance: float, n: float, k: float, internal: float
) -> float:
    """f(o, i) of `eval_lobes` in one band, 1/sr."""
    if kind == CONDUCTOR:
        return reflectance * facets * conductor(cosine, n, k) if facets > 0.0 else 0.0
    if kind == COATED:
        # a coat sends part of the light back to its base
        return facets + reflectance * base / (1.0 - reflectance * internal)
    return reflectance * (facets + base)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def rough_dielectric(  # noqa: PLR0913
    index: float, ax: float, ay: float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float
) -> float:
    """f(o, i) of a rough glass boundary, o the direction light is followed from (Walter et al. 2007, eqs. 20, 21).

    Refraction carries no (eta_o / eta_i)^2: what is transported is power, as both kinds of path here need it.
    """
    eta, oz, iz, hx, hy, hz = facet_between(index, ox, oy, oz, ix, iy, iz)
    oh, ih = ox * hx + oy * hy + oz * hz, ix * hx + iy * hy + iz * hz
    if oh <= 0.0 or ih * iz <= 0.0:
        return 0.0
    reflected, _ = dielectric(oh, eta)
    d = density(hx, hy, hz, ax, ay)
    shadow_o, shadow_i = smith_lambda(ox, oy, oz, ax, ay), smith_lambda(ix, iy, abs(iz), ax, ay)
    if iz > 0.0:
        return reflected * d / (4.0 * oz * iz * (1.0 + shadow_o + shadow_i))
    jacobian = (oh + eta * ih) ** 2
    masking = 1.0 / ((1.0 + shadow_o) * (1.0 + shadow_i))
    return (1.0 - reflected) * d * masking * eta * eta * abs(oh * ih) / (oz * abs(iz) * jacobian)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def facet_between(
    index: float, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float
) -> tuple[float, float, float, float, float, float]:
    """The boundary's facet that turns light between o and i, seen from o's side.

    Returns the index beyond it over that before, oz and iz turned so that oz > 0, and its normal, 0 if there is none.
    """
    eta = index if oz > 0.0 else 1.0 / index
    if oz < 0.0:
        oz, iz = -oz, -iz
    bent = 1.0 if iz > 0.0 else eta
    hx, hy, hz = ox + bent * ix, oy + bent * iy, oz + bent * iz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    if length == 0.0:
        return eta, oz, iz, 0.0, 0.0, 0.0
    if hz < 0.0:
        length = -length
    return eta, oz, iz, hx / length, hy / length, hz / length


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(row: Array, rgb: Array, ox: float, oy: float, oz: float, ix: float, iy: float, iz: float) -> float:
    """Density of `sample` for i given o, 1/sr; 0 for the delta parts."""
    return pdf_lobes(row[0], row[1], row[2], row[3], (rgb[0] + rgb[1] + rgb[2]) / 3.0, ox, oy, oz, ix, iy, iz)


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
    """Density of `sample`, reflectance the mean over its bands."""
    if oz == 0.0 or iz == 0.0 or is_specular_kind(kind, ax, ay):
        return 0.0
    if kind in (DIELECTRIC, SUBSURFACE):
        eta, oz, iz, hx, hy, hz = facet_between(index, ox, oy, oz, ix, iy, iz)
        oh, ih = ox * hx + oy * hy + oz * hz, ix * hx + iy * hy + iz * hz
        if oh <= 0.0 or ih * iz <= 0.0:
            return 0.0
        reflected, _ = dielectric(oh, eta)
        visible = visible_density(ox, oy, oz, hx, hy, hz, ax, ay)
        if iz > 0.0:
            return reflected * visible / (4.0 * oh)
        return (1.0 - reflected) * visible * eta * eta * abs(ih) / (oh + eta * ih) ** 2
    if oz * iz < 0.0:
        return 0.0
    oz, iz = abs(oz), abs(iz)
    if kind in (LAMBERTIAN, EMITTER):
        return iz / math.pi
    hx, hy, hz = ox + ix, oy + iy, oz + iz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    hx, hy, hz = hx / length, hy / length, hz / length
    cosine = ox * hx + oy * hy + oz * hz
    facets = visible_density(ox, oy, oz, hx, hy, hz, ax, ay) / (4.0 * cosine) if cosine > 0.0 else 0.0
    if kind == CONDUCTOR:
        return facets
    share = specular_share(index, reflectance, oz)
    return share * facets + (1.0 - share) * iz / math.pi


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(  # noqa: PLR0913
    row: Array,
    rgb: Array,
    ox: float,
    oy: float,
    oz: float,
    choice: float,
    r1: float,
    r2: float,
    direction: Array,
    weight: Array,
) -> float:
    """Draw i given o -> direction (3,), weight (3,) or (1,) = f |cos i| / density for each band.

    Returns the density, 1/sr; -1 for a delta part (its weight then holds its share), 0 when nothing is scattered.
    """
    weight[:] = 0.0
    if oz == 0.0:
        return 0.0
    side = 1.0 if oz > 0.0 else -1.0
    ax, ay = row[1], row[2]
    smooth = is_specular_row(row)
    if is_boundary(row):
        eta = row[3] if oz > 0.0 else 1.0 / row[3]
        z = abs(oz)
        hx = hy = 0.0
        hz = 1.0
        if not smooth:
            hx, hy, hz = sample_normal(ox, oy, z, ax, ay, r1, r2)
        oh = ox * hx + oy * hy + z * hz
        reflected, beyond = dielectric(oh, eta)
        if choice < reflected:
            x, y, w = 2.0 * oh * hx - ox, 2.0 * oh * hy - oy, 2.0 * oh * hz - z
            if w <= 0.0:
                return 0.0
        else:
            t = oh / eta - beyond
            x, y, w = t * hx - ox / eta, t * hy - oy / eta, t * hz - z / eta
            if w >= 0.0:
                return 0.0
        direction[0], direction[1], direction[2] = x, y, side * w
        if smooth:
            for band in range(weight.shape[0]):
                weight[band] = rgb[band]
            return -1.0
        shadow_o, shadow_i = smith_lambda(ox, oy, z, ax, ay), smith_lambda(x, y, abs(w), ax, ay)
        ratio = (1.0 + shadow_o) / (1.0 + shadow_o + shadow_i) if w > 0.0 else 1.0 / (1.0 + shadow_i)
        for band in range(weight.shape[0]):
            weight[band] = rgb[band] * ratio
        return pdf(row, rgb, ox, oy, oz, x, y, side * w)
    z = abs(oz)
    if row[0] == CONDUCTOR:
        hx = hy = 0.0
        hz = 1.0
        if not smooth:
            hx, hy, hz = sample_normal(ox, oy, z, ax, ay, r1, r2)
        oh = ox * hx + oy * hy + z * hz
        x, y, w = 2.0 * oh * hx - ox, 2.0 * oh * hy - oy, 2.0 * oh * hz - z
        if w <= 0.0:
            return 0.0
        direction[0], direction[1], direction[2] = x, y, side * w
        ratio = 1.0
        if not smooth:
            shadow_o, shadow_i = smith_lambda(ox, oy, z, ax, ay), smith_lambda(x, y, w, ax, ay)
            ratio = (1.0 + shadow_o) / (1.0 + shadow_o + shadow_i)
        for band in range(weight.shape[0]):
            weight[band] = rgb[band] * ratio * conductor(oh, row[4 + band], row[7 + band])
        return -1.0 if smooth else pdf(row, rgb, ox, oy, z, x, y, w)
    if row[0] == COATED and choice < specular_share(row[3], (rgb[0] + rgb[1] + rgb[2]) / 3.0, z):
        hx, hy, hz = sample_normal(ox, oy, z, ax, ay, r1, r2)
        oh = ox * hx + oy * hy + z * hz
        x, y, w = 2.0 * oh * hx - ox, 2.0 * oh * hy - oy, 2.0 * oh * hz - z
    else:
        radius, angle = math.sqrt(r1), 2.0 * math.pi * r2
        x, y, w = radius * math.cos(angle), radius * math.sin(angle), math.sqrt(max(0.0, 1.0 - r1))
    if w <= 0.0:
        return 0.0
    direction[0], direction[1], direction[2] = x, y, side * w
    if is_diffuse(row):
        for band in range(weight.shape[0]):
            weight[band] = rgb[band]
        return w / math.pi
    chance = pdf(row, rgb, ox, oy, z, x, y, w)
    if chance <= 0.0:
        return 0.0
    evaluate(row, rgb, ox, oy, z, x, y, w, weight)
    for band in range(weight.shape[0]):
        weight[band] *= w / chance
    return chance
