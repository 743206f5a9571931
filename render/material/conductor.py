"""Metal: reflection by GGX facets, both sides, with the metal's own Fresnel reflectance at each wavelength.

    parameter         unit  range                        what it is
    metal             -     a name in metals.json        complex refractive index, measured, by wavelength
    roughness         -     0 to 1, image                GGX alpha; below 0.005 a mirror
    roughness_across  -     0.01 to 1, none              GGX alpha along v, for a grain along u; none: as roughness
    tint              -     0 to 1                       factor on the reflectance; below 1 for dirt
    relief            -     normal map, bump map, none   fine shape that shading sees and the truth does not

f = tint F(cos) D G2 / (4 cos_o cos_i): Walter et al. 2007 for GGX, Born and Wolf for the reflectance of a metal.
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numba
import numpy as np

from render.base.arrays import Float
from render.base.errors import InputError
from render.base.model import Model, UnitInterval, quantity
from render.material.fresnel import fresnel_conductor
from render.material.maps import (
    POLISHED,
    GreyTexture,
    Relief,
    Roughness,
    SmoothOrRough,
    polished_alpha,
    relief_field,
)
from render.material.microfacet import (
    dot,
    reflect,
    reflection,
    reflection_pdf,
    reflection_weight,
    sample_visible_normal,
)
from render.material.record import (
    ALPHA_X,
    ALPHA_Y,
    CONDUCTOR,
    METAL_K,
    METAL_N,
    empty_row,
)
from render.material.scattering import NOTHING, Direction, Lobes, Microsurface, Numbers, Sample
from render.material.spectrum import Bands

METALS = Path(__file__).parents[2] / "assets" / "metals.json"
Metal = Literal[
    "iron",
    "steel",
    "stainless_steel",
    "aluminium",
    "copper",
    "brass",
    "gold",
    "silver",
    "titanium",
    "chromium",
    "nickel",
]


class Conductor(Model):
    """Metal: GGX reflection, both sides, with the metal's own reflectance at each wavelength."""

    kind: Literal["conductor"] = "conductor"
    metal: Metal = quantity("steel", label="Metal")
    roughness: SmoothOrRough | GreyTexture = quantity(
        0.15, label="Roughness", help="GGX alpha; 0 mirror (below 0.005), 0.05 polished, 0.15 ground, 0.4 blasted."
    )
    roughness_across: Roughness | None = quantity(
        None, label="Roughness along v", help="For a grain along u; empty: the same in every direction."
    )
    tint: UnitInterval = quantity(1.0, label="Tint", help="Multiplies the reflectance; below 1 for dirt.")
    relief: Relief = relief_field()

    @property
    def albedo(self) -> float:
        return self.tint

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> Float:
        """(ROW,) for kernels (`render.material.record`). InputError: the metal is not known at a wavelength.

        least_alpha: the smallest value of a roughness image; where: the field, for messages.
        """
        row = empty_row(CONDUCTOR)
        row[ALPHA_X] = row[ALPHA_Y] = polished_alpha(self.roughness, least_alpha)
        if self.roughness_across is not None:
            # unequal alphas mark a grain, which must keep its direction even where both are given as equal
            row[ALPHA_X], row[ALPHA_Y] = max(row[ALPHA_X], POLISHED), self.roughness_across
            row[ALPHA_X] *= 1.0 if row[ALPHA_X] != row[ALPHA_Y] else 1.0 - 1e-9
        for band, wavelength_nm in enumerate(bands_nm):
            row[METAL_N + band], row[METAL_K + band] = complex_index(self.metal, wavelength_nm, where)
        return row


@lru_cache(maxsize=1)
def metals() -> dict[str, dict[str, Any]]:
    """label, source, wavelength_nm, n and k of each metal."""
    return dict(json.loads(METALS.read_text(encoding="utf-8")))


def complex_index(metal: str, wavelength_nm: float, where: str = "material") -> tuple[float, float]:
    """n and k, linear between the table's wavelengths. InputError: beyond them."""
    entry = metals()[metal]
    known = entry["wavelength_nm"]
    if not known[0] <= wavelength_nm <= known[-1]:
        raise InputError(
            f"the refractive index of {entry['label'].lower()} is not known at this wavelength",
            where=f"{where}.metal",
            found=f"{wavelength_nm:g} nm",
            allowed=f"{known[0]:g} to {known[-1]:g} nm",
            cure="choose another metal, or a laser within that range",
        )
    return float(np.interp(wavelength_nm, known, entry["n"])), float(np.interp(wavelength_nm, known, entry["k"]))


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate(m: Microsurface, wo: Direction, wi: Direction) -> Lobes:
    """f without the Fresnel reflectance, wo and wi above the surface."""
    facets, cosine = reflection(m, wo, wi)
    return Lobes(facets, cosine, 0.0)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def evaluate_band(lobes: Lobes, tint: float, n: float, k: float) -> float:
    """f in one band, 1/sr, of index n + i k."""
    return tint * lobes.specular * fresnel_conductor(lobes.cosine, n, k) if lobes.specular > 0.0 else 0.0


@numba.njit(nogil=True, cache=True, error_model="numpy")
def pdf(m: Microsurface, wo: Direction, wi: Direction) -> float:
    """pdf of `sample` for a rough metal, 1/sr."""
    return reflection_pdf(m, wo, wi)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def sample(m: Microsurface, specular: bool, wo: Direction, numbers: Numbers) -> Sample:
    """Draw wi off a facet that is visible from wo, which is above the surface."""
    h = (0.0, 0.0, 1.0) if specular else sample_visible_normal(m, wo, numbers[1], numbers[2])
    wi = reflect(wo, h)
    if wi[2] <= 0.0:
        return NOTHING
    if specular:
        return Sample(wi, -1.0, Lobes(1.0, dot(wo, h), 0.0), 1.0)
    return Sample(wi, reflection_pdf(m, wo, wi), Lobes(reflection_weight(m, wo, wi), dot(wo, h), 0.0), 1.0)
