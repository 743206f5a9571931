"""Paint or plastic: a diffuse base under a clear, rough dielectric coat, both sides.

    parameter  unit  range                           what it is
    albedo     -     0 to 1, RGB, image, from mesh   reflectance of the base
    roughness  -     0.01 to 1, image                GGX alpha of the coat
    index      -     1.01 to 3                       refractive index of the coat
    relief     -     normal map, bump map, none      fine shape that shading sees and the truth does not

f = F D G2 / (4 cos_o cos_i) + T(cos_o) T(cos_i) albedo / (pi index^2 (1 - albedo r)): the light is refracted into the
coat, reflected by the base, reflected back to it inside the coat (r, its diffuse reflectance from within) any number
of times, and refracted out (Wolff 1994; Mitsuba's rough plastic with `nonlinear`).
"""

from __future__ import annotations

import math
from typing import Literal

import numba

from render.base.arrays import Float
from render.base.model import Model, quantity
from render.material.fresnel import diffuse_reflectance, fresnel_dielectric
from render.material.lambertian import cosine_hemisphere
from render.material.maps import (
    Albedo,
    GreyTexture,
    Relief,
    Roughness,
    albedo_field,
    packed_alpha,
    relief_field,
)
from render.material.microfacet import reflect, reflection, reflection_pdf, sample_visible_normal
from render.material.record import ALPHA_X, ALPHA_Y, COATED, INDEX, INTERNAL, empty_row
from render.material.scattering import NOTHING, Direction, Lobes, Microsurface, Numbers, Sample
from render.material.spectrum import Bands


class Coated(Model):
    """Paint or plastic: a diffuse base under a clear, rough boundary, both sides."""

    kind: Literal["coated"] = "coated"
    albedo: Albedo = albedo_field("Albedo of the base")
    roughness: Roughness | GreyTexture = quantity(0.1, label="Roughness", help="GGX alpha of the boundary.")
    index: float = quantity(1.5, label="Refractive index", help="Of the coat.", ge=1.01, le=3.0)
    relief: Relief = relief_field()

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> Float:
        """(ROW,) for kernels (`render.material.record`); least_alpha: the smallest value of a roughness image."""
        row = empty_row(COATED)
        row[ALPHA_X] = row[ALPHA_Y] = packed_alpha(self.roughness, least_alpha)
        row[INDEX], row[INTERNAL] = self.index, diffuse_reflectance(1.0 / self.index)
        return row


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(m: Microsurface, wo: Direction, wi: Direction) -> Lobes:
    """f of the coat, and of the base seen through it twice; wo and wi above the surface."""
    facets, cosine = reflection(m, wo, wi)
    reflected, _ = fresnel_dielectric(cosine, m.eta)
    enters, _ = fresnel_dielectric(wi[2], m.eta)
    leaves, _ = fresnel_dielectric(wo[2], m.eta)
    return Lobes(reflected * facets, cosine, (1.0 - enters) * (1.0 - leaves) / (m.eta * m.eta * math.pi))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate_band(lobes: Lobes, reflectance: float, internal: float) -> float:
    """f in one band, 1/sr; internal: the coat's diffuse reflectance from within, which sums the inner reflections."""
    return lobes.specular + reflectance * lobes.diffuse / (1.0 - reflectance * internal)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(m: Microsurface, reflectance: float, wo: Direction, wi: Direction) -> float:
    """pdf of `sample`, 1/sr; reflectance: of the base, the mean over the bands."""
    probability = coat_probability(m.eta, reflectance, wo[2])
    return probability * reflection_pdf(m, wo, wi) + (1.0 - probability) * wi[2] / math.pi


@numba.njit(nogil=True, cache=True, error_model="numpy")
def coat_probability(index: float, reflectance: float, cosine: float) -> float:
    """Probability with which the coat's reflection is sampled rather than the base."""
    reflected, _ = fresnel_dielectric(cosine, index)
    base = (1.0 - reflected) * reflectance
    return reflected / (reflected + base) if reflected + base > 0.0 else 1.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(m: Microsurface, reflectance: float, wo: Direction, numbers: Numbers) -> Sample:
    """Draw wi off the coat or off the base, wo above the surface; reflectance as for `pdf`."""
    if numbers[0] < coat_probability(m.eta, reflectance, wo[2]):
        wi = reflect(wo, sample_visible_normal(m, wo, numbers[1], numbers[2]))
    else:
        wi = cosine_hemisphere(numbers[1], numbers[2])
    if wi[2] <= 0.0:
        return NOTHING
    pdf_of_wi = pdf(m, reflectance, wo, wi)
    if pdf_of_wi <= 0.0:
        return NOTHING
    return Sample(wi, pdf_of_wi, evaluate(m, wo, wi), wi[2] / pdf_of_wi)
