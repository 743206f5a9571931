"""Glass, clear plastic or liquid: a boundary of GGX facets that reflects and refracts, smooth or rough. One-sided.

    parameter  unit  range                        what it is
    substance  -     a name in substances.json    refractive index by wavelength (Sellmeier)
    index      -     1.01 to 3, none              refractive index in place of the substance's
    roughness  -     0 to 1, image                GGX alpha; below 0.005 polished
    tint       -     0 to 1, RGB                  what is left of light at each surface
    priority   -     0 to 99                      which of two transparent bodies is where they overlap: the higher
    relief     -     normal map, bump map, none   fine shape that shading sees and the truth does not

z points out of the substance, so the local frame must be built on the mesh's own normal, not on the one turned towards
the ray. Refraction has no factor (eta_o / eta_i)^2: the BSDF transports power, for paths from the camera and from
lights alike.
"""

from __future__ import annotations

import json
import math
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numba
import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.model import Model, UnitInterval, quantity
from render.material.fresnel import fresnel_dielectric
from render.material.maps import (
    GreyTexture,
    Relief,
    RGBReflectance,
    SmoothOrRough,
    polished_alpha,
    priority_field,
    relief_field,
)
from render.material.microfacet import (
    dot,
    ggx,
    reflect,
    reflection_weight,
    sample_visible_normal,
    smith_lambda,
    visible_normal_pdf,
)
from render.material.record import ALPHA_X, ALPHA_Y, DIELECTRIC, INDEX, empty_row
from render.material.scattering import NOTHING, Direction, Lobes, Microsurface, Numbers, Sample
from render.material.spectrum import Bands

SUBSTANCES = Path(__file__).parents[2] / "assets" / "substances.json"
Substance = Literal["BK7", "fused_silica", "SF11", "sapphire", "acrylic", "polycarbonate", "polystyrene", "water"]


class Glass(Model):
    """Glass, clear plastic or liquid: reflects and refracts. The mesh is closed; what it encloses is filled.

    One-sided: the normals point out of the substance. Bodies keep a gap of air between them, or overlap by priority.
    """

    kind: Literal["glass"] = "glass"
    substance: Substance = quantity("BK7", label="Substance", help="Its refractive index follows the wavelength.")
    index: float | None = quantity(
        None, label="Refractive index", help="In place of the substance's, at every wavelength.", ge=1.01, le=3.0
    )
    roughness: SmoothOrRough | GreyTexture = quantity(
        0.0, label="Surface roughness", help="GGX alpha; 0 polished (below 0.005), 0.1 satin, 0.4 frosted."
    )
    tint: UnitInterval | RGBReflectance = quantity(
        1.0, label="Tint", help="What is left of light at each surface; one number, or R, G, B."
    )
    priority: int = priority_field()
    relief: Relief = relief_field()

    @property
    def albedo(self) -> float | RGBReflectance:
        return self.tint

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> Float:
        """(ROW,) for kernels (`render.material.record`). InputError: the substance is not known at a wavelength.

        least_alpha: the smallest value of a roughness image; where: the field, for messages.
        """
        row = empty_row(DIELECTRIC)
        row[ALPHA_X] = row[ALPHA_Y] = polished_alpha(self.roughness, least_alpha)
        # one path carries three bands, so all are refracted by the index of the middle one
        row[INDEX] = substance_index(self.substance, bands_nm[1], where) if self.index is None else self.index
        return row


@lru_cache(maxsize=1)
def substances() -> dict[str, dict[str, Any]]:
    """label, source, range_nm and Sellmeier coefficients b, c_um2 of each transparent substance."""
    return dict(json.loads(SUBSTANCES.read_text(encoding="utf-8")))


def substance_index(substance: str, wavelength_nm: float, where: str = "material") -> float:
    """n by Sellmeier's equation, n^2 = 1 + sum b l^2 / (l^2 - c). InputError: beyond the range it was measured in."""
    entry = substances()[substance]
    shortest, longest = entry["range_nm"]
    if not shortest <= wavelength_nm <= longest:
        raise InputError(
            f"the refractive index of {entry['label']} is not known at this wavelength",
            where=f"{where}.substance",
            found=f"{wavelength_nm:g} nm",
            allowed=f"{shortest:g} to {longest:g} nm",
            cure="give the index as a number, or choose another substance or laser",
        )
    square_um = (wavelength_nm / 1000.0) ** 2
    terms = zip(entry["b"], entry["c_um2"], strict=True)
    return float(np.sqrt(1.0 + sum(b * square_um / (square_um - c) for b, c in terms)))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(m: Microsurface, wo: Direction, wi: Direction) -> Lobes:
    """f of a rough boundary for directions on any side (Walter et al. 2007, eqs. 20, 21), all in the specular lobe."""
    eta, o, i, h = boundary_facet(m.eta, wo, wi)
    oh, ih = dot(o, h), dot(i, h)
    if oh <= 0.0 or ih * i[2] <= 0.0:
        return Lobes(0.0, 0.0, 0.0)
    reflected, _ = fresnel_dielectric(oh, eta)
    d = ggx(m, h)
    lambda_o, lambda_i = smith_lambda(m, o), smith_lambda(m, i)
    if i[2] > 0.0:
        return Lobes(reflected * d / (4.0 * o[2] * i[2] * (1.0 + lambda_o + lambda_i)), 0.0, 0.0)
    jacobian = (oh + eta * ih) ** 2
    masking = 1.0 / ((1.0 + lambda_o) * (1.0 + lambda_i))
    f = (1.0 - reflected) * d * masking * eta * eta * abs(oh * ih) / (o[2] * abs(i[2]) * jacobian)
    return Lobes(f, 0.0, 0.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(m: Microsurface, wo: Direction, wi: Direction) -> float:
    """pdf of `sample` for a rough boundary, 1/sr."""
    eta, o, i, h = boundary_facet(m.eta, wo, wi)
    oh, ih = dot(o, h), dot(i, h)
    if oh <= 0.0 or ih * i[2] <= 0.0:
        return 0.0
    reflected, _ = fresnel_dielectric(oh, eta)
    visible = visible_normal_pdf(m, o, h)
    if i[2] > 0.0:
        return reflected * visible / (4.0 * oh)
    return (1.0 - reflected) * visible * eta * eta * abs(ih) / (oh + eta * ih) ** 2


@numba.njit(nogil=True, cache=True, error_model="numpy")
def boundary_facet(index: float, wo: Direction, wi: Direction) -> tuple[float, Direction, Direction, Direction]:
    """The microfacet of a boundary that reflects or refracts wo to wi, seen from wo's side.

    Returns the relative index, wo and wi flipped so that wo is above, and the facet's normal (0: there is none).
    """
    eta, oz, iz = relative_index(index, wo), wo[2], wi[2]
    if oz < 0.0:
        oz, iz = -oz, -iz
    scale = 1.0 if iz > 0.0 else eta
    hx, hy, hz = wo[0] + scale * wi[0], wo[1] + scale * wi[1], oz + scale * iz
    length = math.sqrt(hx * hx + hy * hy + hz * hz)
    o, i = (wo[0], wo[1], oz), (wi[0], wi[1], iz)
    if length == 0.0:
        return eta, o, i, (0.0, 0.0, 0.0)
    if hz < 0.0:
        length = -length
    return eta, o, i, (hx / length, hy / length, hz / length)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def relative_index(index: float, wo: Direction) -> float:
    """Refractive index beyond the boundary over that on wo's side."""
    return index if wo[2] > 0.0 else 1.0 / index


@numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)
def sample(m: Microsurface, specular: bool, wo: Direction, numbers: Numbers) -> Sample:
    """Draw wi by reflection or refraction at a facet that is visible from wo, on any side."""
    side = 1.0 if wo[2] > 0.0 else -1.0
    o = (wo[0], wo[1], abs(wo[2]))
    eta = relative_index(m.eta, wo)
    h = (0.0, 0.0, 1.0) if specular else sample_visible_normal(m, o, numbers[1], numbers[2])
    cosine = dot(o, h)
    reflected, beyond = fresnel_dielectric(cosine, eta)
    if numbers[0] < reflected:
        x, y, z = reflect(o, h)
        if z <= 0.0:
            return NOTHING
    else:
        t = cosine / eta - beyond
        x, y, z = t * h[0] - o[0] / eta, t * h[1] - o[1] / eta, t * h[2] - o[2] / eta
        if z >= 0.0:
            return NOTHING
    wi = (x, y, side * z)
    if specular:
        return Sample(wi, -1.0, Lobes(1.0, 0.0, 0.0), 1.0)
    masking = reflection_weight(m, o, wi) if z > 0.0 else 1.0 / (1.0 + smith_lambda(m, wi))
    return Sample(wi, pdf(m, wo, wi), Lobes(masking, 0.0, 0.0), 1.0)
