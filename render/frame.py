"""What a render gives: radiance per light group, and the truth that goes with it. Plain arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from render.base.arrays import Float, Float32, Int
from render.base.counts import Counts
from render.base.finite import check_finite
from render.base.threads import map_chunks
from render.importance import Importance
from render.plan import GroupQuality, Plan

Axis = Literal["rows", "columns"]
ROWS = 64
"""Rows of an image that a thread does at a time."""


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
class Estimate:
    """What a light group knows so far."""

    value: tuple[Float32, ...] | Float32 | Truth
    """For its field of `Frame`."""
    quality: tuple[GroupQuality, ...] = ()
    """Of each laser whose light has begun, or of the ambient light."""


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
    plan: Plan = field(default_factory=Plan)
    """What was computed, what was left out, and why."""
    quality: tuple[GroupQuality, ...] = field(default=(), kw_only=True)
    """How well each light group is known that has begun, in the order in which they are rendered."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall time by stage."""
    foretold: Mapping[str, float] = field(default_factory=dict, kw_only=True)
    """Processor seconds by light group, as its pilot on this machine foretells them; of those that have had one."""
    warnings: tuple[str, ...] = field(default=(), kw_only=True)
    """What may make a sensible picture of the wrong thing (`render.world.material_checks`)."""
    counts: Counts = field(default_factory=dict)
    """Of all light together: rays, seconds inside embree."""
    importance: Importance | None = field(default=None, kw_only=True)
    """Where errors of the light matter, once that is known; None: everywhere alike."""

    def laser(self, index: int) -> Float32:
        """(h, w) radiance of one laser's group: direct and indirect."""
        direct = self.laser_direct[index]
        if not self.laser_indirect:
            return direct
        both, reflected = np.empty_like(direct), self.laser_indirect[index]

        def work(start: int, stop: int) -> None:
            np.add(direct[start:stop], reflected[start:stop], out=both[start:stop])

        map_chunks(work, len(direct), ROWS)
        return both

    def quality_of(self, group: str, laser: str | None = None) -> GroupQuality | None:
        """How well a light group is known, of the laser of that name; None: it has not begun."""
        return next((one for one in self.quality if (one.group, one.laser) == (group, laser)), None)

    @property
    def awaits_ambient(self) -> bool:
        """Ambient light is to come; without it the line has too little noise, and no texture beside it."""
        ambient = self.plan.step("ambient", "ambient")
        return ambient is not None and bool(ambient.computed) and self.quality_of("ambient") is None

    @property
    def unfinished(self) -> bool:
        """Some light group of the plan has reached neither its target error nor the most work that it may take."""
        if self.awaits_ambient:
            return True
        reflected = [one for one in self.quality if one.group == "indirect"]
        if len(reflected) < len(self.laser_indirect):
            return True
        return any(one.reason == "unfinished" for one in self.quality)

    def with_estimate(self, field: str, estimate: Estimate) -> Frame:
        """The frame with what a light group now knows, as its field."""
        groups = {one.group for one in estimate.quality}
        quality = (*(one for one in self.quality if one.group not in groups), *estimate.quality)
        changes: dict[str, Any] = {field: estimate.value, "quality": quality}
        return replace(self, **changes)

    def carrying(self, before: Frame) -> Frame:
        """The frame, with what it has not come to yet as it was in a frame that it goes on from."""
        begun = {one.group for one in self.quality}
        return replace(
            self,
            laser_direct=self.laser_direct or before.laser_direct,
            laser_indirect=self.laser_indirect or before.laser_indirect,
            ambient=before.ambient if self.ambient is None else self.ambient,
            truth=before.truth if self.truth is None else self.truth,
            quality=(*(one for one in before.quality if one.group not in begun), *self.quality),
        )

    def check(self, known: Frame | None = None) -> None:
        """InputError: the light or the exact lines hold a number that is none. Truth has NaN where nothing is hit.

        known: a frame that was checked; what it has too is not looked at again.
        """
        checked = set() if known is None else {id(image) for image in known.light}
        for radiance in self.light:
            if id(radiance) not in checked:
                check_finite("render", radiances=radiance)
        for curve in self.curves if known is None or known.curves is not self.curves else ():
            check_finite("render", line_positions=curve.position, points_of_the_line=curve.point)

    @property
    def light(self) -> tuple[Float32, ...]:
        """The images of all light groups so far."""
        return (*self.laser_direct, *self.laser_indirect, *(() if self.ambient is None else (self.ambient,)))

    @property
    def shape(self) -> tuple[int, int]:
        if self.laser_direct:
            return (self.laser_direct[0].shape[0], self.laser_direct[0].shape[1])
        image = self.ambient if self.ambient is not None else self.truth.depth_z if self.truth is not None else None
        if image is None:
            raise ValueError("an empty frame has no shape")
        return (image.shape[0], image.shape[1])
