"""Materials. Each object has one; `kind` tells which model, so that older projects stay readable when one joins.

Two-sided are the opaque ones: light on either side is treated alike. One-sided are glass and subsurface, whose normals
point out of the substance, and the light of an emitter, which leaves where its normals point.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from render.base.model import Model, UnitInterval, quantity

RGBReflectance = tuple[UnitInterval, UnitInterval, UnitInterval]


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


def _relief() -> Any:
    help = "Fine shape that shading sees and the truth does not."
    return quantity(None, label="Relief", help=help, discriminator="kind")


class FromMesh(Model):
    """Use the colour or texture that the mesh file brings (OBJ with MTL, GLB); grey 0.5 where it brings none."""

    source: Literal["mesh"] = "mesh"


class Lambertian(Model):
    """Ideal diffuse reflection, both sides: radiance = albedo E / pi."""

    kind: Literal["lambertian"] = "lambertian"
    albedo: UnitInterval | RGBReflectance | Texture | FromMesh = quantity(
        0.5, label="Albedo", help="One number, three for R, G, B, a texture, or what the mesh file says."
    )
    relief: NormalMap | BumpMap | None = _relief()


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
Roughness = Annotated[float, Field(ge=0.01, le=1.0)]
SmoothOrRough = Annotated[float, Field(ge=0.0, le=1.0)]
POLISHED = 0.005
"""A GGX alpha below this is taken for a perfectly smooth surface, a mirror."""
Radiance = Annotated[float, Field(ge=0.0, le=1e9)]
ScatteringAlbedo = Annotated[float, Field(ge=0.0, le=0.99999)]
PRIORITY = "Where transparent bodies overlap, the one of the highest priority is there: glass 1 over water 0."
MeanFreePath = Annotated[float, Field(ge=1e-6, le=10.0)]


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
    relief: NormalMap | BumpMap | None = _relief()

    @property
    def albedo(self) -> float:
        return self.tint


class Coated(Model):
    """Paint or plastic: a diffuse base under a clear, rough boundary, both sides."""

    kind: Literal["coated"] = "coated"
    albedo: UnitInterval | RGBReflectance | Texture | FromMesh = quantity(
        0.5, label="Albedo of the base", help="One number, three for R, G, B, a texture, or what the mesh file says."
    )
    roughness: Roughness | GreyTexture = quantity(0.1, label="Roughness", help="GGX alpha of the boundary.")
    index: float = quantity(1.5, label="Refractive index", help="Of the coat.", ge=1.01, le=3.0)
    relief: NormalMap | BumpMap | None = _relief()


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
    priority: int = quantity(0, label="Priority", help=PRIORITY, ge=0, le=99)
    relief: NormalMap | BumpMap | None = _relief()

    @property
    def albedo(self) -> float | RGBReflectance:
        return self.tint


class Subsurface(Model):
    """Wax, marble, nylon, skin: light wanders below a rough boundary and leaves elsewhere. The mesh is closed.

    One-sided as glass is. The boundary is never polished: light from inside could then not be connected to a camera
    or a lamp outside, and would be found by chance alone.
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
    priority: int = quantity(0, label="Priority", help=PRIORITY, ge=0, le=99)
    relief: NormalMap | BumpMap | None = _relief()

    @property
    def albedo(self) -> float:
        return 1.0


class Emitter(Model):
    """A surface that shines evenly to its front, and reflects diffusely on both sides. Ambient light, not laser light.

    The front is where the normals point.
    """

    kind: Literal["emitter"] = "emitter"
    radiance: tuple[Radiance, Radiance, Radiance] = quantity(
        (1.0, 1.0, 1.0), unit="W/(m^2 sr)", label="Radiance", help="Of the red, green and blue band."
    )
    albedo: UnitInterval | RGBReflectance | Texture | FromMesh = quantity(
        0.5, label="Albedo", help="One number, three for R, G, B, a texture, or what the mesh file says."
    )
    relief: NormalMap | BumpMap | None = _relief()


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

# Where the red, green and blue values of an albedo are taken to hold, nm.
BAND_CENTRES_NM = (610.0, 545.0, 465.0)


def at_wavelength(rgb: tuple[float, float, float], wavelength_nm: float) -> float:
    """An RGB value interpolated at one wavelength."""
    return sum(weight * value for weight, value in zip(reflectance_weights(wavelength_nm), rgb, strict=True))


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
