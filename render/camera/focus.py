"""What a render does with the lens, told before it starts, and a tilt that leaves nothing in focus."""

from __future__ import annotations

import math

import numpy as np

from render.base.errors import InputError
from render.camera.camera import Camera

GRID = 9


def lens_lines(camera: Camera) -> tuple[str, ...]:
    """The plan's lines about the lens; "left out:" begins what is not done. A blur is never done twice."""
    if camera.lens.model == "pinhole":
        return (
            "left out: the lens's blur (defocus, diffraction) - rendered as a pinhole, every depth is in focus; the "
            "sensor's defocus, where it is on, blurs by depth when the image is developed",
        )
    lens = camera.lens
    focus = "far away" if lens.focus_distance is None else f"at {lens.focus_distance:.4g} m"
    line = f"lens: f/{lens.f_number:g} focused {focus}, {2e3 * camera.aperture_radius:.3g} mm of aperture sampled"
    tilt = focus_tilt(camera)
    if tilt > 0.0:
        line += f", plane of focus tilted by {math.degrees(tilt):.3g} deg"
    blind = 1.0 - sharp_share(camera)
    if blind > 0.0:
        line += f"; in {blind:.0%} of the image no depth is in focus"
    return (
        f"{line}; the sensor's defocus is not applied again",
        "left out: diffraction - the sensor's lens blur stands for it",
    )


def focus_tilt(camera: Camera) -> float:
    """rad; between the plane of focus and the plane that faces the camera. 90 deg: it runs along the axis."""
    plane = camera.focus_plane
    return math.atan2(math.hypot(plane[0], plane[1]), plane[2])


def sharp_share(camera: Camera) -> float:
    """Share of the image whose chief rays meet the plane of focus ahead of the camera; focused far away counts."""
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
