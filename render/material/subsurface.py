"""Wax, marble, nylon, skin: light is scattered below a rough boundary and leaves elsewhere. One-sided.

    parameter          unit  range                        what it is
    index              -     1.01 to 3                    refractive index of the boundary
    roughness          -     0.05 to 1                    GGX alpha of the boundary, never polished
    mean_free_path     m     1e-6 to 10 , RGB             from one scattering to the next
    scattering_albedo  -     0 to 0.99999, RGB            share of light that one scattering leaves
    anisotropy         -     -0.98 to 0.98                mean cosine g of a scattering: 0 even, towards 1 forward
    priority           -     0 to 99                      which of two transparent bodies is where they overlap
    relief             -     normal map, bump map, none   fine shape that shading sees and the truth does not

The boundary has the BSDF of a rough `dielectric`, so there is none here. The integrators trace the random walk between
two hits of the boundary, by the phase function in `medium.py`.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from render.base.model import Model, quantity
from render.material.maps import Relief, priority_field, relief_field
from render.material.record import (
    ALPHA_X,
    ALPHA_Y,
    ANISOTROPY,
    EXTINCTION,
    INDEX,
    SCATTERED,
    SUBSURFACE,
    empty_row,
)
from render.material.spectrum import Bands, at_wavelength, per_band

ScatteringAlbedo = Annotated[float, Field(ge=0.0, le=0.99999)]
MeanFreePath = Annotated[float, Field(ge=1e-6, le=10.0)]


class Subsurface(Model):
    """Wax, marble, nylon, skin: light is scattered below a rough boundary and leaves elsewhere. The mesh is closed.

    One-sided as glass is. The boundary is never polished: vertices inside could then not be connected to a camera or a
    lamp outside.
    """

    kind: Literal["subsurface"] = "subsurface"
    index: float = quantity(1.5, label="Refractive index", ge=1.01, le=3.0)
    roughness: float = quantity(0.3, label="Surface roughness", help="GGX alpha of the boundary.", ge=0.05, le=1.0)
    mean_free_path: MeanFreePath | tuple[MeanFreePath, MeanFreePath, MeanFreePath] = quantity(
        0.0005, unit="m", label="Mean free path", help="From one scattering to the next; one number, or R, G, B."
    )
    scattering_albedo: ScatteringAlbedo | tuple[ScatteringAlbedo, ScatteringAlbedo, ScatteringAlbedo] = quantity(
        0.99, label="Scattering albedo", help="Share of light that one scattering leaves; one number, or R, G, B."
    )
    anisotropy: float = quantity(
        0.0, label="Anisotropy", help="Mean cosine g of scattering: 0 even, towards 1 forward.", ge=-0.98, le=0.98
    )
    priority: int = priority_field()
    relief: Relief = relief_field()

    @property
    def albedo(self) -> float:
        return 1.0

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> NDArray[np.float64]:
        """(ROW,) for kernels (`render.material.record`)."""
        row = empty_row(SUBSURFACE)
        row[ALPHA_X] = row[ALPHA_Y] = self.roughness
        row[INDEX], row[ANISOTROPY] = self.index, self.anisotropy
        free_path, albedo = per_band(self.mean_free_path), per_band(self.scattering_albedo)
        for band, wavelength_nm in enumerate(bands_nm):
            row[EXTINCTION + band] = 1.0 / at_wavelength(free_path, wavelength_nm)
            row[SCATTERED + band] = at_wavelength(albedo, wavelength_nm)
        return row
