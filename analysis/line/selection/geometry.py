"""Which peaks can be the line at all: on the laser plane, inside the working volume, within reach of laser and camera.

A peak's ray meets the laser plane in one point. Light that arrives over a detour (a reflection, a second bounce)
seldom puts that point where the rig can measure (Trucco & Fisher; Nygards & Wernersson), and a rough mirror makes it
wider than the sheet is there. Single frame, no other knowledge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.line.result import Line
from render.base.arrays import Float
from render.base.errors import InputError
from render.camera.camera import Camera
from render.laser.laser import LineLaser, laser_plane

Mask = NDArray[np.bool_]


LENS = 1.5
"""px of sigma allowed for pixel, lens and defocus."""


@dataclass(frozen=True)
class WorkingVolume:
    """Where the rig measures: the camera, one laser, its pose in the camera's frame, and depths or a box.

    nearest, farthest: depth along the camera's axis, m. low, high: (3,) corners of a box in the camera's frame, m.
    """

    camera: Camera
    laser: LineLaser
    T_camera_laser: Float
    nearest: float = 0.0
    farthest: float = np.inf
    low: tuple[float, float, float] | None = None
    high: tuple[float, float, float] | None = None
    widest: float = 4.0
    """A peak may be so many times as wide as the sheet is there across the ray, for slanted surfaces, and LENS px."""

    def __post_init__(self) -> None:
        if not 0.0 <= self.nearest < self.farthest:
            found = f"{self.nearest} to {self.farthest} m"
            raise InputError("the working range is empty", where="working volume", found=found, allowed="near < far")


def consistent(line: Line, volume: WorkingVolume) -> Mask:
    """(n, k): the peaks that could be the laser's direct light on something inside the volume."""
    possible = np.zeros(line.u.shape, np.bool_)
    pixels, index, rank = line.pixels()
    if len(pixels) == 0:
        return possible
    normalised, seen = volume.camera.normalise(pixels)
    rays = np.column_stack([normalised, np.ones(len(normalised))])
    plane = laser_plane(volume.T_camera_laser)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = rays * (-plane[3] / (rays @ plane[:3]))[:, None]
    good = seen & np.isfinite(points).all(axis=1)
    good &= (points[:, 2] >= volume.nearest) & (points[:, 2] <= volume.farthest) & (points[:, 2] > 0.0)
    R, t = volume.T_camera_laser[:3, :3], volume.T_camera_laser[:3, 3]
    beam = (points - t) @ R  # laser frame: the fan opens along y about z
    good &= (beam[:, 2] > 0.0) & (np.abs(beam[:, 1]) <= beam[:, 2] * volume.laser.tan_half_fan)
    with np.errstate(invalid="ignore", divide="ignore"):
        sheet = volume.laser.sigma(np.maximum(beam[:, 2], 0.0)) * volume.camera.fx / points[:, 2]
        good &= line.width[index, rank] <= volume.widest * sheet + LENS
    for corner, sign in ((volume.low, 1.0), (volume.high, -1.0)):
        if corner is not None:
            good &= (sign * (points - np.asarray(corner)) >= 0.0).all(axis=1)
    possible[index, rank] = good
    return possible
