"""Ideal diffuse reflection, both sides.

    parameter  unit  range                           what it is
    albedo     -     0 to 1, RGB, image, from mesh   reflectance
    relief     -     normal map, bump map, none      fine shape that shading sees and the truth does not

f = albedo / pi, with cosine-weighted sampling.
"""

from __future__ import annotations

import math
from typing import Literal

import numba

from render.base.arrays import Float
from render.base.model import Model
from render.material.maps import Albedo, Relief, albedo_field, relief_field
from render.material.record import LAMBERTIAN, empty_row
from render.material.scattering import Direction, Lobes, Numbers, Sample
from render.material.spectrum import Bands


class Lambertian(Model):
    """Ideal diffuse reflection, both sides: radiance = albedo E / pi."""

    kind: Literal["lambertian"] = "lambertian"
    albedo: Albedo = albedo_field()
    relief: Relief = relief_field()

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> Float:
        """(ROW,) for kernels (`render.material.record`)."""
        return empty_row(LAMBERTIAN)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(wo: Direction, wi: Direction) -> Lobes:
    """f, wo and wi above the surface."""
    return Lobes(0.0, 0.0, 1.0 / math.pi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(wo: Direction, wi: Direction) -> float:
    """pdf of `sample`, 1/sr."""
    return wi[2] / math.pi


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(numbers: Numbers) -> Sample:
    """Draw wi from the cosine-weighted hemisphere."""
    wi = cosine_hemisphere(numbers[1], numbers[2])
    return Sample(wi, max(wi[2], 0.0) / math.pi, Lobes(0.0, 0.0, 1.0), 1.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def cosine_hemisphere(r1: float, r2: float) -> Direction:
    """A direction with the pdf cos / pi, for r1, r2 in [0, 1)."""
    radius, angle = math.sqrt(r1), 2.0 * math.pi * r2
    return radius * math.cos(angle), radius * math.sin(angle), math.sqrt(max(0.0, 1.0 - r1))
