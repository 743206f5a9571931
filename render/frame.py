"""What a render gives: radiance per light group, and the truth that goes with it. Plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from render.base.counts import Counts
from render.base.finite import check_finite

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Int = NDArray[np.int32]
Axis = Literal["rows", "columns"]


@dataclass(frozen=True)
class LaserCurve:
    """The exact line of one laser: one entry for each crossing of the lit and seen curve with a scan line's centre.

    On axis "rows", `index` is the image row v and `position` the sub-pixel column u; on "columns" the other way round.
    Sorted by index, then position. All (n,) unless said; float64.
    """

    axis: Axis
    index: Int
    position: Float
    point: Float
    """(n, 3) m, camera frame."""
    depth_z: Float
    depth_range: Float
    object_id: Int
    """Index into `scene.visible_objects`."""
    camera_angle: Float
    """Angle between the facet's normal and the direction to the camera, rad."""
    laser_angle: Float
    """Angle between the facet's normal and the direction to the laser, rad."""
    irradiance: Float
    """W/m^2 on the facet, at the centre of the sheet."""
    segments: Float
    """(m, 2, 3) m, world frame: the curve cut from the triangles that face camera and laser (before occlusion)."""
    sheet_bias: Float
    """px along the scan line, to the centre of mass of the sheet's light on the surface (`render.truth.sheet_bias`):
    what the sheet's width adds to a measured position. NaN: not known."""


@dataclass(frozen=True)
class Truth:
    """Per-pixel truth at pixel centres, computed in float64; NaN or -1 where nothing is hit."""

    depth_z: Float32
    """(h, w) m along the camera's axis."""
    depth_range: Float32
    """(h, w) m from the camera's centre."""
    position: Float32
    """(h, w, 3) m, world frame."""
    normal: Float32
    """(h, w, 3) unit facet normal, world frame, towards the camera."""
    object_id: Int
    """(h, w) index into `scene.visible_objects`, -1 for none."""


@dataclass(frozen=True)
class Frame:
    """One step of a scan."""

    step: int
    laser_direct: tuple[Float32, ...]
    """For each laser (h, w) radiance at its wavelength, W/(m^2 sr), light that met one surface only."""
    laser_indirect: tuple[Float32, ...] = field(default=(), kw_only=True)
    """For each laser (h, w) radiance of its light that met two or more surfaces; empty: left out."""
    ambient: Float32 | None
    """(h, w, 3) radiance of ambient light in the bands R, G, B, W/(m^2 sr); None: the scene has no ambient light."""
    curves: tuple[LaserCurve, ...]
    """For each laser."""
    truth: Truth | None
    plan: str
    """What was computed, what was left out, and why; one line each."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    warnings: tuple[str, ...] = field(default=(), kw_only=True)
    """What may make a sensible picture of the wrong thing (`render.world.material_checks`)."""
    counts: Counts = field(default_factory=dict)
    """Rays, samples, lit pixels, seconds inside embree, estimated relative error."""

    def laser(self, index: int) -> Float32:
        """(h, w) radiance of one laser's group: direct and indirect."""
        direct = self.laser_direct[index]
        return direct + self.laser_indirect[index] if self.laser_indirect else direct

    def check(self) -> None:
        """InputError: the light or the exact lines hold a number that is none. Truth has NaN where nothing is hit."""
        for radiance in (*self.laser_direct, *self.laser_indirect, *([] if self.ambient is None else [self.ambient])):
            check_finite("render", radiances=radiance)
        for curve in self.curves:
            check_finite("render", line_positions=curve.position, points_of_the_line=curve.point)

    @property
    def shape(self) -> tuple[int, int]:
        if self.laser_direct:
            return (self.laser_direct[0].shape[0], self.laser_direct[0].shape[1])
        image = self.ambient if self.ambient is not None else self.truth.depth_z if self.truth is not None else None
        if image is None:
            raise ValueError("an empty frame has no shape")
        return (image.shape[0], image.shape[1])
