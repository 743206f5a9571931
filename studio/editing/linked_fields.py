"""Fields that change together, so that one edit leaves a model whole: sensor size and centre, pitch and focal length.

A camera stores pixels (fx, cx); a person thinks of a lens in millimetres behind a sensor.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel

from render.base.errors import InputError
from render.camera.camera import Camera
from render.sensor.sensor import Sensor, SpectralCurve

Assign = Callable[[Any, Any], dict[str, Any]]

# Transmission of the dyes of a colour sensor, typical (nm, share): only for a start when a sensor is made colour.
DYES = (
    ((350, 400, 560, 600, 700, 1000), (0.1, 0.03, 0.03, 0.9, 0.95, 1.0)),
    ((350, 440, 480, 530, 580, 620, 700, 830, 1000), (0.1, 0.06, 0.45, 0.9, 0.6, 0.15, 0.2, 1.0, 1.0)),
    ((350, 400, 460, 500, 540, 700, 830, 1000), (0.3, 0.6, 0.85, 0.4, 0.07, 0.06, 1.0, 1.0)),
)


@dataclass(frozen=True)
class Derived:
    """A value that a form shows and takes though the model stores it in another way."""

    name: str
    label: str
    help: str
    unit: str
    before: str
    """The field it is shown in front of."""
    read: Callable[[Any], float]
    assign: Assign
    below: Callable[[Any], float | None] = lambda model: None
    """What it must be less than, beside the limit of the field that stores it."""


def with_image_distance(camera: Camera, value: float) -> dict[str, Any]:
    """fx and fy for a distance (m) from the lens to the sensor; their ratio stays."""
    fx = value / camera.pixel_pitch
    return {"fx": fx, "fy": fx * camera.fy / camera.fx}


def with_focal_length(camera: Camera, value: float) -> dict[str, Any]:
    """fx and fy for a lens of a focal length (m) that is focused where the camera's is.

    InputError: it is as far away as the focus, or farther.
    """
    if value == camera.focal_length:
        return {}  # rounding would change it
    focus = camera.lens.focus_distance
    if focus is None:
        return with_image_distance(camera, value)
    if value >= focus:
        raise InputError(
            "no lens of that focal length is focused there",
            where="focal length of the camera",
            found=f"{1e3 * value:.4g} mm",
            allowed=f"less than the focus distance, {1e3 * focus:.4g} mm",
        )
    return with_image_distance(camera, value * focus / (focus - value))


def with_focus(camera: Camera, value: float | None) -> dict[str, Any]:
    """The lens focused at a distance (m; None: far away) as by its ring: its focal length stays, so fx and fy follow.

    InputError: it is no farther away than the focal length.
    """
    if value == camera.lens.focus_distance:
        return {}  # rounding would change fx
    focal_length = camera.focal_length
    if value is not None and value <= focal_length:
        raise InputError(
            "a lens of this focal length is not focused there",
            where="focus distance of the camera",
            found=f"{1e3 * value:.4g} mm",
            allowed=f"more than the focal length, {1e3 * focal_length:.4g} mm",
        )
    image_distance = focal_length if value is None else value * focal_length / (value - focal_length)
    # as plain fields, so that the lens is validated with the camera
    lens = {name: getattr(camera.lens, name) for name in type(camera.lens).model_fields} | {"focus_distance": value}
    return {"lens": lens} | with_image_distance(camera, image_distance)


def with_width(camera: Camera, value: int) -> dict[str, Any]:
    """A centred principal point stays centred."""
    centred = abs(camera.cx - (camera.width - 1) / 2) < 1e-6
    return {"width": value} | ({"cx": (value - 1) / 2} if centred else {})


def with_height(camera: Camera, value: int) -> dict[str, Any]:
    """As `with_width`."""
    centred = abs(camera.cy - (camera.height - 1) / 2) < 1e-6
    return {"height": value} | ({"cy": (value - 1) / 2} if centred else {})


def with_pixel_pitch(camera: Camera, value: float) -> dict[str, Any]:
    """The lens stays, so fx and fy follow."""
    scale = camera.pixel_pitch / value
    return {"pixel_pitch": value, "fx": camera.fx * scale, "fy": camera.fy * scale}


def with_colour(sensor: Sensor, value: str) -> dict[str, Any]:
    """As many efficiency curves as the colours need: typical dyes over a mono curve, or the envelope of three."""
    if value == sensor.colour:
        return {}
    efficiency: tuple[SpectralCurve, ...]
    if value == "mono":
        efficiency = (_combined(sensor.efficiency, np.maximum),)
    else:
        dyes = [SpectralCurve.model_validate({"wavelength_nm": nm, "value": share}) for nm, share in DYES]
        efficiency = tuple(_combined((sensor.efficiency[0], dye), np.multiply) for dye in dyes)
    return {"colour": value, "efficiency": efficiency}


def _combined(curves: tuple[SpectralCurve, ...], operation: np.ufunc) -> SpectralCurve:
    """At all knots of the curves."""
    knots = sorted({nm for curve in curves for nm in curve.wavelength_nm})
    sampled = [np.interp(knots, curve.wavelength_nm, curve.value, left=0.0, right=0.0) for curve in curves]
    values = tuple(round(float(value), 4) for value in operation.reduce(sampled))
    return SpectralCurve(wavelength_nm=tuple(knots), value=values)


FOCUS = ("scene", "rig", "camera", "lens", "focus_distance")
"""Where a project has the distance whose change by a person is `with_focus` of the camera."""
LINKED: dict[tuple[type[BaseModel], str], Assign] = {
    (Camera, "width"): with_width,
    (Camera, "height"): with_height,
    (Camera, "pixel_pitch"): with_pixel_pitch,
    (Sensor, "colour"): with_colour,
}
DERIVED: dict[type[BaseModel], tuple[Derived, ...]] = {
    Camera: (
        Derived(
            "focal_length",
            "Focal length",
            "Of the lens, by image distance and focus distance: 1/f = 1/image distance + 1/focus distance. Typing it "
            "sets the image distance, with fx and fy. Focusing keeps it, as turning a lens's ring does, and the image "
            "distance follows.",
            "m",
            "fx",
            lambda camera: camera.focal_length,
            with_focal_length,
            lambda camera: camera.lens.focus_distance,
        ),
        Derived(
            "image_distance",
            "Image distance",
            "From the lens to the sensor: fx times the pixel pitch; typing it sets fx and fy, as a calibration "
            "measures them, and with them the focal length, which it is where the lens is focused far away.",
            "m",
            "fx",
            lambda camera: camera.image_distance,
            with_image_distance,
        ),
    )
}
