"""The camera: pinhole or thin lens with skew and OpenCV distortion, pixel centres at integers.

    x = X/Z, y = Y/Z  ->  (x', y') = distort(x, y)  ->  u = fx x' + skew y' + cx,  v = fy y' + cy

`project` runs the model forwards, `rays` inverts it (to 1e-10 px); both say where the model has no answer. They follow
the ray through the lens's centre; what the rest of the aperture sees is in `render.camera.lens`.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from render.base.model import Model, UnitInterval, quantity
from render.base.pose import Pose
from render.camera.distortion import distort_points, fold_radii, undistort_points
from render.camera.view import View

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)
MAX_SIDE = 32768
MOST_TILT = math.radians(80)
Coefficient = Annotated[float, Field(ge=-1e9, le=1e9)]
"""A distortion coefficient: with a long lens, whose image radius is small, a calibration may well give millions."""
FASTEST = 0.5
"""Least f-number of a thin lens: that of the widest aperture that the sine condition allows in air."""


class Lens(Model):
    """What the lens does to the amount of light and to what is out of focus; the geometry is in the camera."""

    model: Literal["pinhole", "thin-lens"] = quantity(
        "pinhole",
        label="Rendered as",
        help="pinhole: sharp at every depth, so that f-number and focus may change after the render. thin-lens: rays "
        "through the whole aperture, blurred off the plane of focus, which tilts with the sensor (tauX, tauY).",
    )
    f_number: float = quantity(1.4, label="f-number", help="Focal length over entrance pupil.", ge=0.1, le=256)
    transmission: UnitInterval = quantity(0.9, label="Transmission", help="Of lens and filter, at the laser.")
    focus_distance: float | None = quantity(
        None,
        unit="m",
        label="Focus distance",
        help="Empty: far away. Focused here, the lens keeps its focal length, and image distance, fx and fy follow; a "
        "study that varies it keeps fx.",
        ge=1e-3,
        le=1e6,
    )
    vignetting: bool = quantity(True, label="Natural vignetting", help="cos^4 fall-off towards the corners.")


class Camera(Model):
    """A camera on the rig. Frame: x right, y down, z forward (OpenCV)."""

    width: int = quantity(unit="px", label="Width", gt=0, le=MAX_SIDE)
    height: int = quantity(unit="px", label="Height", gt=0, le=MAX_SIDE)
    fx: float = quantity(unit="px", label="fx", help="Image distance over pixel pitch.", ge=0.01, le=1e7)
    fy: float = quantity(unit="px", label="fy", ge=0.01, le=1e7)
    cx: float = quantity(unit="px", label="cx", help="Centred: (width - 1) / 2.", ge=-1e6, le=1e6)
    cy: float = quantity(unit="px", label="cy", help="Centred: (height - 1) / 2.", ge=-1e6, le=1e6)
    skew: float = quantity(0.0, unit="px", label="Skew", ge=-1e5, le=1e5)
    distortion: tuple[Coefficient, ...] = quantity(
        (), label="Distortion", help="OpenCV: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [taux tauy]]]]."
    )
    pixel_pitch: float = quantity(3.45e-6, unit="m", label="Pixel pitch", ge=1e-8, le=1e-2)
    lens: Lens = Lens()
    T_rig_camera: Pose = Pose()

    @field_validator("distortion")
    @classmethod
    def _known_length(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(value) not in DISTORTION_LENGTHS:
            raise ValueError(f"has {len(value)} coefficients; allowed: 0, 4, 5, 8, 12 or 14")
        for name, tilt in zip(("taux", "tauy"), value[12:], strict=False):
            if abs(tilt) > MOST_TILT:
                raise ValueError(f"{name} is {tilt:g} rad; allowed: -{MOST_TILT:.4g} to {MOST_TILT:.4g} rad")
        return value

    @model_validator(mode="after")
    def _lens_is_possible(self) -> Camera:
        if self.lens.model == "thin-lens":
            image_distance, focus = self.image_distance, self.lens.focus_distance
            if self.lens.f_number < FASTEST:
                raise ValueError(
                    f"lens.f_number is {self.lens.f_number:g}; allowed for a thin lens: {FASTEST:g} or more, the limit "
                    "of any lens in air"
                )
            if focus is not None and focus <= image_distance:
                raise ValueError(
                    f"lens.focus_distance is {1e3 * focus:.4g} mm; allowed for a thin lens: more than the image "
                    f"distance, {1e3 * image_distance:.4g} mm (fx times pixel pitch)"
                )
        return self

    @classmethod
    def from_physical(
        cls,
        width: int,
        height: int,
        pixel_pitch: float,
        focal_length: float,
        *,
        f_number: float = 1.4,
        focus_distance: float | None = None,
        T_rig_camera: Pose = Pose(),
        distortion: tuple[float, ...] = (),
    ) -> Camera:
        """Centred camera from lengths in m. A thin lens focused at s has its image at f s / (s - f), so fx grows."""
        image_distance = focal_length
        if focus_distance is not None:
            if focus_distance <= focal_length:
                raise ValueError(f"focus_distance {focus_distance} m must exceed the focal length {focal_length} m")
            image_distance = focal_length * focus_distance / (focus_distance - focal_length)
        return cls(
            width=width,
            height=height,
            fx=image_distance / pixel_pitch,
            fy=image_distance / pixel_pitch,
            cx=(width - 1) / 2,
            cy=(height - 1) / 2,
            pixel_pitch=pixel_pitch,
            distortion=distortion,
            lens=Lens(f_number=f_number, focus_distance=focus_distance),
            T_rig_camera=T_rig_camera,
        )

    @cached_property
    def matrix(self) -> Array:
        """(3, 3) camera matrix K."""
        return np.array([[self.fx, self.skew, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @cached_property
    def coefficients(self) -> Array:
        """(14,) distortion, zero padded."""
        padded = np.zeros(14)
        padded[: len(self.distortion)] = self.distortion
        return padded

    @property
    def has_distortion(self) -> bool:
        return any(c != 0.0 for c in self.distortion)

    @property
    def image_distance(self) -> float:
        """From the lens to the sensor, m."""
        return self.fx * self.pixel_pitch

    @property
    def focal_length(self) -> float:
        """Focal length f of the thin lens, m: 1 / f = 1 / image distance + 1 / focus distance."""
        return self.image_distance / (1.0 + self.image_distance * self.focus_vergence)

    @property
    def focus_vergence(self) -> float:
        """1 / focus distance, 1/m; 0 where the lens is focused at infinity."""
        return 0.0 if self.lens.focus_distance is None else 1.0 / self.lens.focus_distance

    @property
    def aperture_radius(self) -> float:
        """Radius of the aperture, m: half of focal length over f-number."""
        return 0.5 * self.focal_length / self.lens.f_number

    @property
    def focus_plane(self) -> Array:
        """(4,) plane of focus in the camera frame, tilted with the sensor: -g1 X - g2 Y + Z / s - 1 = 0."""
        tau_x, tau_y = self.coefficients[12:]
        g1 = math.tan(tau_y) / math.cos(tau_x) / self.image_distance
        return np.array([-g1, math.tan(tau_x) / self.image_distance, self.focus_vergence, -1.0])

    @property
    def working_f_number(self) -> float:
        """Working f-number N (1 + m), m the magnification of the focused plane."""
        if self.lens.focus_distance is None:
            return self.lens.f_number
        return self.lens.f_number * (1.0 + self.image_distance / self.lens.focus_distance)

    def scaled(self, scale: float) -> Camera:
        """The same view with `scale` times the pixels a side (pixel-centre convention kept).

        The sides are rounded; fx, fy follow each side's own ratio, so that the field of view is kept exactly.
        """
        width, height = max(1, round(self.width * scale)), max(1, round(self.height * scale))
        sx, sy = width / self.width, height / self.height
        return self.model_copy(
            update={
                "width": width,
                "height": height,
                "fx": self.fx * sx,
                "fy": self.fy * sy,
                "skew": self.skew * sx,
                "cx": (self.cx + 0.5) * sx - 0.5,
                "cy": (self.cy + 0.5) * sy - 0.5,
                "pixel_pitch": self.pixel_pitch / sx,
            }
        )

    def project(self, points: Array) -> tuple[Array, Mask]:
        """(..., 3) points in the camera frame -> (..., 2) pixels (u, v) and (...) valid.

        Invalid: behind the camera, or beyond the radius where the distortion folds back. Pixels may lie off the image.
        """
        flat = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 3))
        ahead = flat[:, 2] > 0.0
        normalised = flat[:, :2] / np.where(ahead, flat[:, 2], 1.0)[:, None]
        distorted, inside = distort_points(normalised, self.coefficients, self.fold_table)
        pixels = np.empty_like(distorted)
        pixels[:, 0] = self.fx * distorted[:, 0] + self.skew * distorted[:, 1] + self.cx
        pixels[:, 1] = self.fy * distorted[:, 1] + self.cy
        valid = ahead & inside
        pixels[~valid] = np.nan
        shape = np.shape(points)[:-1]
        return pixels.reshape(*shape, 2), valid.reshape(shape)

    def normalise(self, pixels: Array) -> tuple[Array, Mask]:
        """(..., 2) pixels -> (..., 2) undistorted (X/Z, Y/Z) and (...) valid; residual below 1e-10 px where valid."""
        flat = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        distorted = np.empty_like(flat)
        distorted[:, 1] = (flat[:, 1] - self.cy) / self.fy
        distorted[:, 0] = (flat[:, 0] - self.cx - self.skew * distorted[:, 1]) / self.fx
        normalised, valid = undistort_points(
            distorted, self.coefficients, self.fold_table, 1e-10 / max(self.fx, self.fy)
        )
        normalised[~valid] = np.nan
        shape = np.shape(pixels)[:-1]
        return normalised.reshape(*shape, 2), valid.reshape(shape)

    def rays(self, pixels: Array) -> tuple[Array, Mask]:
        """(..., 2) pixels -> (..., 3) unit directions in the camera frame and (...) valid (no ray: NaN, False)."""
        normalised, valid = self.normalise(pixels)
        directions = np.concatenate([normalised, np.ones((*normalised.shape[:-1], 1))], axis=-1)
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        return directions, valid

    def view(self, T_world_camera: Array) -> View:
        """The camera at the pose T_world_camera (4, 4), as the kernels read it."""
        intrinsics = np.array([self.fx, self.fy, self.cx, self.cy, self.skew])
        lens = np.zeros(4)
        if self.lens.model == "thin-lens":
            plane = self.focus_plane
            lens = np.array([self.aperture_radius, plane[2], -plane[0], -plane[1]])
        return View(self.width, intrinsics, self.coefficients, self.fold_table, T_world_camera, lens)

    @property
    def fold_table(self) -> Array:
        """(720,) radius, by angle, up to which the distortion is one-to-one."""
        return _cached_folds(self.distortion)


@lru_cache(maxsize=64)
def _cached_folds(distortion: tuple[float, ...]) -> Array:
    padded = np.zeros(14)
    padded[: len(distortion)] = distortion
    return fold_radii(padded)
