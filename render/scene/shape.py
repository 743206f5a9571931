"""What an object is made of: a mesh file, a primitive, or the paper's weld joint. Descriptions only, no triangles.

Primitives are centred on their own origin, in metres, with outward normals (counter-clockwise triangles).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from render.base.model import Model, quantity

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "um": 1e-6, "in": 0.0254}
Unit = Literal["m", "cm", "mm", "um", "in"]
SMALLEST = 1e-6
"""Of any length of a shape, m: a pixel's worth under a microscope."""


class MeshFile(Model):
    """Triangles from a PLY, STL, OBJ, GLB, GLTF or OFF file."""

    kind: Literal["file"] = "file"
    path: str = quantity(label="File", help="Relative to the project file.", min_length=1, max_length=1000)
    unit: Unit = quantity("m", label="Unit of the file")
    sha256: str | None = quantity(
        None, label="SHA-256", help="Of the file; filled in when saved.", pattern="^[0-9a-f]{64}$"
    )


class Plane(Model):
    """A rectangle in the x-y plane, facing +z."""

    kind: Literal["plane"] = "plane"
    width: float = quantity(1.0, unit="m", label="Width", help="Along x.", ge=SMALLEST, le=1e4)
    height: float = quantity(1.0, unit="m", label="Height", help="Along y.", ge=SMALLEST, le=1e4)


class Box(Model):
    """An axis-aligned box."""

    kind: Literal["box"] = "box"
    size_x: float = quantity(0.1, unit="m", label="Size x", ge=SMALLEST, le=1e4)
    size_y: float = quantity(0.1, unit="m", label="Size y", ge=SMALLEST, le=1e4)
    size_z: float = quantity(0.1, unit="m", label="Size z", ge=SMALLEST, le=1e4)


class Sphere(Model):
    """A sphere with vertices on the surface: `segments` around, half as many from pole to pole (poles on z)."""

    kind: Literal["sphere"] = "sphere"
    radius: float = quantity(0.05, unit="m", label="Radius", ge=SMALLEST, le=1e4)
    segments: int = quantity(256, label="Segments", ge=8, le=2048)


class Cylinder(Model):
    """A closed cylinder along z with vertices on the surface."""

    kind: Literal["cylinder"] = "cylinder"
    radius: float = quantity(0.05, unit="m", label="Radius", ge=SMALLEST, le=1e4)
    length: float = quantity(0.2, unit="m", label="Length", ge=SMALLEST, le=1e4)
    segments: int = quantity(256, label="Segments", ge=3, le=65536)


class StepBlock(Model):
    """A staircase of treads climbing along +x and +z, on a base `rise` thick; bottom at z = 0, centred in x, y."""

    kind: Literal["step_block"] = "step_block"
    steps: int = quantity(4, label="Steps", ge=1, le=1000)
    tread: float = quantity(0.02, unit="m", label="Tread", help="Along x.", ge=SMALLEST, le=1e3)
    rise: float = quantity(0.01, unit="m", label="Rise", help="Along z.", ge=SMALLEST, le=1e3)
    width: float = quantity(0.1, unit="m", label="Width", help="Along y.", ge=SMALLEST, le=1e3)


class VGroove(Model):
    """A plate, top at z = 0, with a symmetric V groove of full opening `angle` and `depth` along y."""

    kind: Literal["v_groove"] = "v_groove"
    angle: float = quantity(math.radians(90), unit="rad", label="Opening", ge=0.01, le=math.radians(179.9))
    depth: float = quantity(0.02, unit="m", label="Depth", ge=SMALLEST, le=1e3)
    width: float = quantity(0.2, unit="m", label="Width", help="Along x.", ge=SMALLEST, le=1e3)
    length: float = quantity(0.2, unit="m", label="Length", help="Along y.", ge=SMALLEST, le=1e3)
    thickness: float = quantity(0.03, unit="m", label="Thickness", ge=SMALLEST, le=1e3)

    @model_validator(mode="after")
    def _groove_fits(self) -> VGroove:
        opening = 2 * self.depth * math.tan(self.angle / 2)
        if opening >= self.width:
            raise ValueError(f"a groove {opening:.6g} m wide does not fit in width {self.width:.6g} m")
        if self.depth >= self.thickness:
            raise ValueError(f"depth {self.depth:.6g} m must be less than thickness {self.thickness:.6g} m")
        return self


class WeldTee(Model):
    """The founding paper's single-bevel tee joint, seam along y.

    Base plate with its top at z = 0; an upright plate standing on it, its face towards +x at x = 0, bevelled at its
    foot; and a convex rippled fillet bead in the corner. UV runs along the seam (u) and the developed section (v).
    """

    kind: Literal["weld_tee"] = "weld_tee"
    length: float = quantity(0.3, unit="m", label="Seam length", ge=SMALLEST, le=10)
    base_width: float = quantity(0.3, unit="m", label="Base width", ge=SMALLEST, le=10)
    upright_height: float = quantity(0.15, unit="m", label="Upright height", ge=SMALLEST, le=10)
    thickness: float = quantity(0.012, unit="m", label="Plate thickness", ge=SMALLEST, le=1)
    bevel_angle: float = quantity(math.radians(45), unit="rad", label="Bevel angle", ge=0, le=math.radians(75))
    leg: float = quantity(0.012, unit="m", label="Bead leg", help="Of the fillet, on both plates.", ge=SMALLEST, le=1)
    convexity: float = quantity(0.0015, unit="m", label="Bead convexity", ge=0, le=0.1)
    ripple_pitch: float = quantity(0.003, unit="m", label="Ripple pitch", ge=SMALLEST, le=1)
    ripple_height: float = quantity(0.0003, unit="m", label="Ripple height", help="Peak to valley.", ge=0, le=0.1)
    ground_band: float = quantity(0.04, unit="m", label="Ground band", help="Width on each plate.", ge=0, le=10)
    triangles: int = quantity(100_000, label="Bead triangles", help="About.", ge=100, le=5_000_000)

    @model_validator(mode="after")
    def _bead_fits(self) -> WeldTee:
        if self.leg >= min(self.upright_height, self.base_width / 2):
            raise ValueError(f"leg {self.leg:.6g} m must be less than upright_height and half of base_width")
        if self.convexity > self.leg / 2 or self.ripple_height > self.leg / 2:
            raise ValueError(f"convexity and ripple_height must be at most half of leg ({self.leg / 2:.6g} m)")
        return self


Primitive = Plane | Box | Sphere | Cylinder | StepBlock | VGroove
"""What `render.mesh.primitives` makes."""
Parametric = Primitive | WeldTee
"""What is made of numbers, and not read from a file."""
Shape = Annotated[MeshFile | Parametric, Field(discriminator="kind")]
