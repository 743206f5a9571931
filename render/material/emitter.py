"""A surface that emits a constant radiance to its front, and reflects diffusely on both sides.

    parameter  unit         range                           what it is
    radiance   W/(m^2 sr)   0 to 1e9, RGB                   of the red, green and blue band, towards the normal's side
    albedo     -            0 to 1, RGB, image, from mesh   reflectance
    relief     -            normal map, bump map, none      fine shape that shading sees and the truth does not

Its BSDF is that of `lambertian`. Its light is ambient light: `render.ambient.light_sampling` samples it as a lamp.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from render.base.model import Model, quantity
from render.material.maps import Albedo, Relief, albedo_field, relief_field
from render.material.record import EMITTED, EMITTER, empty_row
from render.material.spectrum import Bands

Radiance = Annotated[float, Field(ge=0.0, le=1e9)]


class Emitter(Model):
    """A surface that shines evenly to its front, and reflects diffusely on both sides. Ambient light, not laser light.

    The front is where the normals point.
    """

    kind: Literal["emitter"] = "emitter"
    radiance: tuple[Radiance, Radiance, Radiance] = quantity(
        (1.0, 1.0, 1.0), unit="W/(m^2 sr)", label="Radiance", help="Of the red, green and blue band."
    )
    albedo: Albedo = albedo_field()
    relief: Relief = relief_field()

    def pack(self, bands_nm: Bands, least_alpha: float = 1.0, where: str = "material") -> NDArray[np.float64]:
        """(ROW,) for kernels (`render.material.record`)."""
        row = empty_row(EMITTER)
        row[EMITTED : EMITTED + 3] = self.radiance
        return row
