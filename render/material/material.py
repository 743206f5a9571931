"""What an object is made of: one of the models beside this file, or a blend of two, distinguished by `kind`.

Opaque materials are two-sided: light on either side is scattered alike. Glass and subsurface are one-sided: their
normals point out of the substance. So is the light of an emitter, which leaves on the side its normals point to.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from render.base.model import Model, quantity
from render.material.coated import Coated
from render.material.conductor import Conductor
from render.material.dielectric import Glass
from render.material.emitter import Emitter
from render.material.lambertian import Lambertian
from render.material.maps import POLISHED, BumpMap, FromMesh, GreyTexture, NormalMap, Texture
from render.material.spectrum import BAND_CENTRES_NM, reflectance_weights
from render.material.subsurface import Subsurface

__all__ = [
    "BAND_CENTRES_NM",
    "POLISHED",
    "BaseMaterial",
    "Blend",
    "BumpMap",
    "Coated",
    "Conductor",
    "Emitter",
    "FromMesh",
    "Glass",
    "GreyTexture",
    "Lambertian",
    "Material",
    "NormalMap",
    "OpaqueMaterial",
    "Subsurface",
    "Texture",
    "reflectance_weights",
]

BaseMaterial = Annotated[Lambertian | Conductor | Coated | Glass | Subsurface | Emitter, Field(discriminator="kind")]
"""The material of a surface at one point: any model but a blend."""
OpaqueMaterial = Annotated[Lambertian | Conductor | Coated, Field(discriminator="kind")]


class Blend(Model):
    """Two materials side by side: `over` where the mask is white, `base` where it is black, mixed between."""

    kind: Literal["blend"] = "blend"
    base: OpaqueMaterial = Lambertian()
    over: OpaqueMaterial = Conductor()
    mask: Texture = quantity(label="Mask", help="Its red values, linear; needs UV.")


Material = Annotated[
    Lambertian | Conductor | Coated | Blend | Glass | Subsurface | Emitter, Field(discriminator="kind")
]
