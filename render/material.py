"""Materials. Each object has one; `kind` tells which model, so that more can join without changing a file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from render.model import Model, UnitInterval, quantity

RGBReflectance = tuple[UnitInterval, UnitInterval, UnitInterval]


class Texture(Model):
    """An image file, mapped by the mesh's UV, bilinear, repeated outside [0, 1]."""

    path: str = quantity(label="Image", help="Relative to the project file.", min_length=1, max_length=1000)
    srgb: bool = quantity(True, label="sRGB encoded", help="Off: the values are linear reflectance.")
    scale: float = quantity(1.0, label="Factor", help="Multiplies the values.", gt=0, le=1)


class FromMesh(Model):
    """Use the colour or texture that the mesh file brings (OBJ with MTL, GLB); grey 0.5 where it brings none."""

    source: Literal["mesh"] = "mesh"


class Lambertian(Model):
    """Ideal diffuse reflection, both sides: radiance = albedo E / pi."""

    kind: Literal["lambertian"] = "lambertian"
    albedo: UnitInterval | RGBReflectance | Texture | FromMesh = quantity(
        0.5, label="Albedo", help="One number, three for R, G, B, a texture, or what the mesh file says."
    )


Material = Annotated[Lambertian, Field()]

# Where the red, green and blue values of an albedo are taken to hold, nm.
BAND_CENTRES_NM = (610.0, 545.0, 465.0)


def reflectance_weights(wavelength_nm: float) -> tuple[float, float, float]:
    """Weights of (R, G, B) that interpolate an RGB albedo linearly at one wavelength, constant beyond the bands."""
    red, green, blue = BAND_CENTRES_NM
    if wavelength_nm >= red:
        return 1.0, 0.0, 0.0
    if wavelength_nm >= green:
        t = (wavelength_nm - green) / (red - green)
        return t, 1.0 - t, 0.0
    if wavelength_nm >= blue:
        t = (wavelength_nm - blue) / (green - blue)
        return 0.0, t, 1.0 - t
    return 0.0, 0.0, 1.0
