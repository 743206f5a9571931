"""What an object is made of: one of the models beside this file, or a blend of two, told apart by `kind`.

Two-sided are the opaque ones: light on either side is treated alike. One-sided are glass and subsurface, whose normals
point out of the substance, and the light of an emitter, which leaves where its normals point.
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
"""What a surface is made of at one point."""
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
