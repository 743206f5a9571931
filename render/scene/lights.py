"""Ambient light: a constant environment, point lights and rectangular area lights, in RGB bands."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from render.base.model import Model, quantity
from render.base.pose import Pose

Channel = Annotated[float, Field(ge=0.0, le=1e9)]
RGB = tuple[Channel, Channel, Channel]


class PointLight(Model):
    """Radiates the same intensity in every direction."""

    kind: Literal["point"] = "point"
    name: str = quantity("lamp", label="Name", min_length=1, max_length=100)
    intensity: RGB = quantity((1.0, 1.0, 1.0), unit="W/sr", label="Intensity", help="Per colour band R, G, B.")
    T_world_light: Pose = Pose()


class RectangleLight(Model):
    """A rectangle in its own x-y plane that radiates on the side of +z with constant radiance."""

    kind: Literal["rectangle"] = "rectangle"
    name: str = quantity("panel", label="Name", min_length=1, max_length=100)
    radiance: RGB = quantity((1.0, 1.0, 1.0), unit="W/(m^2 sr)", label="Radiance", help="Per colour band R, G, B.")
    width: float = quantity(0.3, unit="m", label="Width", help="Along x.", ge=1e-6, le=1e4)
    height: float = quantity(0.3, unit="m", label="Height", help="Along y.", ge=1e-6, le=1e4)
    T_world_light: Pose = Pose()


Light = Annotated[PointLight | RectangleLight, Field(discriminator="kind")]


class Environment(Model):
    """Constant radiance from every direction that no object blocks."""

    radiance: RGB = quantity((0.0, 0.0, 0.0), unit="W/(m^2 sr)", label="Radiance", help="Per colour band R, G, B.")
