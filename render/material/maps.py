"""Material parameters that an image may give: albedo, roughness, and relief (normal and bump maps)."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from render.base.model import Model, UnitInterval, quantity

RGBReflectance = tuple[UnitInterval, UnitInterval, UnitInterval]
Roughness = Annotated[float, Field(ge=0.01, le=1.0)]
SmoothOrRough = Annotated[float, Field(ge=0.0, le=1.0)]
POLISHED = 0.005
"""A GGX alpha below this is treated as perfectly smooth: its BSDF is a delta function."""


class Texture(Model):
    """An image file, mapped by the mesh's UV, bilinear, repeated outside [0, 1]."""

    path: str = quantity(label="Image", help="Relative to the project file.", min_length=1, max_length=1000)
    srgb: bool = quantity(True, label="sRGB encoded", help="Off: the values are linear reflectance.")
    scale: float = quantity(1.0, label="Factor", help="Multiplies the values.", ge=1e-6, le=1)


class GreyTexture(Model):
    """An image file whose grey values are the numbers themselves, mapped as a texture is."""

    path: str = quantity(label="Image", help="Relative to the project file.", min_length=1, max_length=1000)
    scale: float = quantity(1.0, label="Factor", help="The number that white stands for.", ge=1e-6, le=1)


class NormalMap(Model):
    """An image of normals in the frame of the texture: R along u, G along v, B out of the surface.

    The middle code (128 of 255) is zero.
    """

    kind: Literal["normal_map"] = "normal_map"
    path: str = quantity(label="Image", help="Relative to the project file.", min_length=1, max_length=1000)
    strength: float = quantity(1.0, label="Strength", help="Multiplies the slopes.", ge=0, le=10)
    green_down: bool = quantity(False, label="Green points down", help="As Direct3D has it; off: as OpenGL has it.")


class BumpMap(Model):
    """A grey image of heights: slopes are shaded as if they were there, the surface itself stays as it is."""

    kind: Literal["bump_map"] = "bump_map"
    path: str = quantity(label="Image", help="Relative to the project file.", min_length=1, max_length=1000)
    height: float = quantity(
        1e-4, unit="m", label="Height", help="Of white above black; negative: below.", ge=-1.0, le=1.0
    )


class FromMesh(Model):
    """Use the colour or texture that the mesh file brings (OBJ with MTL, GLB); grey 0.5 where it brings none."""

    source: Literal["mesh"] = "mesh"


Albedo = UnitInterval | RGBReflectance | Texture | FromMesh
Relief = NormalMap | BumpMap | None


def albedo_field(label: str = "Albedo") -> Any:
    """The field of a diffuse reflectance."""
    help = "One number, three for R, G, B, a texture, or what the mesh file says."
    return quantity(0.5, label=label, help=help)


def relief_field() -> Any:
    """The field of a relief, which every model has."""
    help = "Fine shape that shading sees and the truth does not."
    return quantity(None, label="Relief", help=help, discriminator="kind")


def priority_field() -> Any:
    """The field that decides between transparent bodies that overlap."""
    help = "Where transparent bodies overlap, the one of the highest priority is there: glass 1 over water 0."
    return quantity(0, label="Priority", help=help, ge=0, le=99)


def packed_alpha(roughness: float | GreyTexture, least_alpha: float) -> float:
    """The roughness in a material's row; least_alpha, its smallest value, where it is an image."""
    return least_alpha if isinstance(roughness, GreyTexture) else roughness


def polished_alpha(roughness: float | GreyTexture, least_alpha: float) -> float:
    """As `packed_alpha`, but 0 below `POLISHED`."""
    alpha = packed_alpha(roughness, least_alpha)
    return alpha if alpha >= POLISHED else 0.0
