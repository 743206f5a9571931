"""The thin lens in the plan of a render, and a check for sensor tilts that leave nothing in focus."""

from __future__ import annotations

import math

import numpy as np

from render.base.errors import InputError
from render.camera.camera import Camera
from render.plan import ThinLens, TransportStep

GRID = 9
"""Points a side at which the image is sampled."""


def thin_lens(camera: Camera) -> ThinLens | None:
    """The thin lens, as the plan of a render describes it; None: a pinhole."""
    lens = camera.lens
    if lens.model == "pinhole":
        return None
    return ThinLens(
        lens.f_number, lens.focus_distance, 2.0 * camera.aperture_radius, focus_tilt(camera), 1.0 - sharp_share(camera)
    )


def lens_steps(camera: Camera) -> tuple[TransportStep, ...]:
    """Which blur of the lens is rendered, and which is left to the sensor or ignored; no blur is applied twice."""
    if camera.lens.model == "pinhole":
        return (
            TransportStep("lens", "defocus", False, "pinhole"),
            TransportStep("lens", "diffraction", False, "pinhole"),
        )
    return (TransportStep("lens", "defocus", True, "always"), TransportStep("lens", "diffraction", False, "sensor"))


def focus_tilt(camera: Camera) -> float:
    """Angle between the plane of focus and the image plane, rad; at 90 deg the plane of focus contains the axis."""
    plane = camera.focus_plane
    return math.atan2(math.hypot(plane[0], plane[1]), plane[2])


def sharp_share(camera: Camera) -> float:
    """Fraction of the image whose chief rays meet the plane of focus in front of the camera; 1 without tilt."""
    plane = camera.focus_plane
    if not plane[:2].any():
        return 1.0
    u, v = np.linspace(-0.5, camera.width - 0.5, GRID), np.linspace(-0.5, camera.height - 0.5, GRID)
    slopes, known = camera.normalise(np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2))
    vergence = slopes[known] @ plane[:2] + plane[2]
    return float(np.mean(vergence > 0.0)) if len(vergence) else 0.0


def check_lens(camera: Camera) -> None:
    """InputError: the sensor's tilt turns the plane of focus behind the camera, or the sensor into the lens."""
    if camera.lens.model == "pinhole":
        return
    plane = camera.focus_plane
    tau_x, tau_y = (math.degrees(tau) for tau in camera.coefficients[12:])
    found = f"tauX {tau_x:.3g} deg, tauY {tau_y:.3g} deg"
    if camera.aperture_radius * math.hypot(plane[0], plane[1]) >= 0.9:
        raise InputError(
            "the tilted sensor reaches into the lens",
            where="scene.rig.camera.distortion",
            found=found,
            allowed=f"a sensor behind the whole aperture of {2e3 * camera.aperture_radius:.3g} mm",
            cure="tilt the sensor less, or close the aperture",
        )
    if sharp_share(camera) == 0.0:
        raise InputError(
            "the plane of focus lies behind the camera wherever the image looks, so that nothing is sharp",
            where="scene.rig.camera.distortion",
            found=found,
            allowed="a tilt whose plane of focus passes through the view",
            cure="tilt the sensor less or the other way, focus nearer, or render it as a pinhole",
        )
