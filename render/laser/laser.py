"""Line lasers: a sheet of light x = 0 that leaves the origin along z and opens along y.

Through the plane at distance z the flux density is  E = P g(x; sigma(z)) h(y / z) / z  (W/m^2), with g a
unit-area Gaussian, sigma(z) half of the sheet's 1/e^2 half-width, h the fan profile, unit area on |Y| <= tan(fan/2).
The light flows along (x sigma'/sigma, y/z, 1), which conserves energy exactly, so a surface of normal n receives
E |n . (x sigma'/sigma, y/z, 1)| and any closed surface around the laser receives P.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from render.base.model import Model, quantity
from render.base.pose import Pose

Array = NDArray[np.float64]

UNIFORM, GAUSSIAN, CONSTANT = 0, 1, 2
PROFILE_CODES = {"uniform": UNIFORM, "gaussian": GAUSSIAN, "constant": CONSTANT}


class Divergence(Model):
    """A sheet that opens linearly from the origin: sigma(z) = z tan(full_angle / 2) / 2."""

    kind: Literal["divergence"] = "divergence"
    full_angle: float = quantity(
        1.15e-3, unit="rad", label="Divergence", help="Full 1/e^2 angle across the sheet.", ge=1e-6, le=0.5
    )


class Waist(Model):
    """A focused sheet: w(z) = waist sqrt(1 + ((z - focus) / z_R)^2), z_R = pi waist^2 / (M^2 lambda), sigma = w / 2."""

    kind: Literal["waist"] = "waist"
    radius: float = quantity(100e-6, unit="m", label="Waist", help="1/e^2 half-width at the focus.", ge=1e-6, le=0.1)
    focus_distance: float = quantity(0.8, unit="m", label="Focus distance", ge=0, le=1e4)
    m_squared: float = quantity(1.5, label="M^2", help="Beam quality across the sheet.", ge=1, le=1e4)


class LineLaser(Model):
    """A line laser on the rig."""

    name: str = quantity("laser", label="Name", min_length=1, max_length=100)
    power: float = quantity(0.02, unit="W", label="Power", help="Optical, leaving the laser.", ge=0, le=1e4)
    wavelength_nm: float = quantity(450.0, unit="nm", label="Wavelength", ge=200, le=2000)
    fan_angle: float = quantity(
        math.radians(45),
        unit="rad",
        label="Fan angle",
        help="Full angle of the sheet.",
        ge=math.radians(0.001),
        le=math.radians(170),
    )
    fan_profile: Literal["uniform", "gaussian", "constant"] = quantity(
        "uniform",
        label="Fan profile",
        help="uniform: flat on a flat target (Powell lens); gaussian: 1/e^2 at the fan's edges (cylinder lens); "
        "constant: the same radiant intensity in every direction.",
    )
    sheet: Annotated[Divergence | Waist, Field(discriminator="kind")] = Divergence()
    T_rig_laser: Pose = Pose()

    @property
    def tan_half_fan(self) -> float:
        return math.tan(self.fan_angle / 2)

    def sheet_parameters(self) -> tuple[float, float, float]:
        """(sigma0, focus, z_R) with sigma(z) = sigma0 sqrt(1 + ((z - focus)/z_R)^2).

        A divergence is the limit of zero waist at the origin: sigma0 = 0, and z_R holds dsigma/dz instead.
        """
        if isinstance(self.sheet, Divergence):
            return 0.0, 0.0, math.tan(self.sheet.full_angle / 2) / 2
        z_r = math.pi * self.sheet.radius**2 / (self.sheet.m_squared * self.wavelength_nm * 1e-9)
        return self.sheet.radius / 2, self.sheet.focus_distance, z_r

    def sigma(self, z: Array | float) -> Array:
        """Sheet sigma (m) at distances z (m) along the laser's axis."""
        sigma0, focus, z_r = self.sheet_parameters()
        z = np.asarray(z, dtype=np.float64)
        if sigma0 == 0.0:
            return z_r * z
        return np.asarray(sigma0 * np.sqrt(1.0 + ((z - focus) / z_r) ** 2))

    def packed(self) -> Array:
        """(8,) parameters for the kernels in `render.laser.irradiance`."""
        return np.array(
            [
                self.power,
                *self.sheet_parameters(),
                self.tan_half_fan,
                PROFILE_CODES[self.fan_profile],
                self.wavelength_nm,
                0.0,
            ]
        )


def laser_plane(T_camera_laser: Array) -> Array:
    """(4, 4) pose -> (4,) plane (a, b, c, d) in the camera frame, unit normal, d <= 0: the laser's x axis, oriented."""
    normal = T_camera_laser[:3, 0]
    d = -float(normal @ T_camera_laser[:3, 3])
    return np.append(normal, d) * (-1.0 if d > 0 else 1.0)
