"""What of a render can be looked at: developed images, each light group on its own, all light together, depth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from analysis.report.colour import wavelength_colour
from analysis.report.units import grouped
from render.base.arrays import Float32
from render.frame import Frame, Truth
from render.output.tone_mapping import Picture, colour, colour_table, grey, mapped, white_level
from render.scene.scene import Scene
from render.sensor.develop import Image, expected_electrons
from studio.preview.preview_image import PreviewImage
from studio.preview.saturation import full_electrons
from studio.project.project import Project
from studio.scan.stages import scaled

DEPTH_MAP = "viridis"
SHAPE_BRIGHTNESS = 0.45
"""Of what a live picture shows beside the line."""
OF_A_LASER = ("image", "laser", "reflected")
"""Kinds of views that each laser has."""
SATURATED = "#ff2d78"
"""Of pixels that are painted as saturated: no light and no theme has this colour."""


@dataclass(frozen=True)
class View:
    """One way to look at a render."""

    kind: Literal["image", "laser", "reflected", "light", "ambient", "depth"]
    laser: int
    label: str
    unit: str


def views(scene: Scene, frame: Frame) -> list[View]:
    """The ways that a frame allows; the first is what the sensor delivers."""
    many = len(scene.lasers) > 1
    found = [View("image", i, f"Image, {item.name}" if many else "Image", "DN") for i, item in enumerate(scene.lasers)]
    found = found or [View("image", 0, "Image", "DN")]
    for i, item in enumerate(scene.lasers):
        found.append(View("laser", i, f"Light of {item.name}", "W/(m² sr)"))
        if frame.laser_indirect:
            found.append(View("reflected", i, f"Light of {item.name}, reflected on", "W/(m² sr)"))
    if frame.ambient is not None:
        found.append(View("ambient", 0, "Ambient light", "W/(m² sr)"))
        found.append(View("light", 0, "All light, in colour", "W/(m² sr)"))
    elif many:
        found.append(View("light", 0, "All light, in colour", "W/(m² sr)"))
    if frame.truth is not None:
        found.append(View("depth", 0, "Depth", "mm"))
    return found


def numbers(view: View, frame: Frame, images: list[Image]) -> NDArray[Any] | None:
    """The array (h, w) or (h, w, 3) behind a view; None: it is not there yet, or the view is a mixture."""
    if view.kind == "image":
        return images[view.laser].pixels if view.laser < len(images) else None
    if view.kind == "laser":
        return frame.laser(view.laser)
    if view.kind == "reflected":
        return frame.laser_indirect[view.laser]
    if view.kind == "ambient":
        return frame.ambient
    if view.kind == "depth" and frame.truth is not None:
        return frame.truth.depth_z
    return None


def picture(
    view: View, scene: Scene, frame: Frame, images: list[Image], bright: bool, paint: bool = False
) -> Picture | None:
    """(h, w) picture of a view; None: it is not there yet.

    bright: faint light is lifted (square root). paint: what is saturated in an image, in its own colour.
    """
    array = numbers(view, frame, images)
    if view.kind == "light":
        total = all_light(scene, frame)
        return colour(total, white_level(total.max(axis=2)), bright)
    if array is None:
        return None
    if view.kind == "image":
        image = images[view.laser]
        if image.pixels.ndim == 3:  # as the camera hands it out
            drawn, full = colour(array.astype(np.float32), image.saturation, False), array.max(axis=2)
        else:
            drawn, full = grey(array, image.black_level, image.saturation, bright), array
        return _painted(drawn, full >= image.saturation) if paint else drawn
    if view.kind == "ambient":
        return colour(array, white_level(array[..., 1]), bright)
    if view.kind == "depth":
        some = array[np.isfinite(array)]
        low, high = (float(some.min()), float(some.max())) if len(some) else (0.0, 1.0)
        return mapped(array, low, high, colour_table(DEPTH_MAP))
    return grey(array, 0.0, white_level(array), bright)


def all_light(scene: Scene, frame: Frame) -> Float32:
    """(h, w, 3) every group in its colour: ambient bands, and each laser in the colour of its wavelength."""
    height, width = frame.shape
    total = np.zeros((height, width, 3), np.float32) if frame.ambient is None else frame.ambient.copy()
    for i, laser in enumerate(scene.lasers):
        light = frame.laser(i)
        for band, share in enumerate(wavelength_colour(laser.wavelength_nm)):
            if share > 0.0:
                total[..., band] += np.float32(share) * light
    return total


def at_pixel(scene: Scene, frame: Frame, images: list[Image], row: int, column: int) -> list[tuple[str, str]]:
    """Name and value, ready to read, of everything known about a pixel."""
    height, width = frame.shape
    if not (0 <= row < height and 0 <= column < width):
        return []
    rows = [("u, v", f"{column}, {row}")]
    for i, image in enumerate(images):
        name = f"DN {scene.lasers[i].name}" if len(images) > 1 else "DN"
        if image.processed:
            rows.append((name, ", ".join(str(number) for number in np.atleast_1d(image.pixels[row, column]))))
            continue
        number = int(image.pixels[row, column])
        electrons = (number - image.black_level) / image.gain
        full = ", saturated" if number >= image.saturation else f" ({grouped(electrons)} e-)"
        rows.append((name, f"{number}{full}"))
    for i, laser in enumerate(scene.lasers):
        direct = float(frame.laser_direct[i][row, column])
        further = f" + {float(frame.laser_indirect[i][row, column]):.3g} reflected" if frame.laser_indirect else ""
        rows.append((laser.name, f"{direct:.3g}{further} W/(m² sr)"))
    if frame.ambient is not None:
        rows.append(("ambient", f"{float(frame.ambient[row, column].mean()):.3g} W/(m² sr)"))
    if frame.truth is not None:
        item = int(frame.truth.object_id[row, column])
        if item >= 0:
            rows.append(("depth", f"{1e3 * float(frame.truth.depth_z[row, column]):.3f} mm"))
            rows.append(("object", scene.visible_objects[item].name))
        else:
            rows.append(("object", "none"))
    return rows


def at_live_pixel(scene: Scene, image: PreviewImage, row: int, column: int) -> list[tuple[str, str]]:
    """As `at_pixel`, of a preview of the scene; row and column are the camera's own."""
    i = min(int((row + 0.5) * image.scale), image.depth_z.shape[0] - 1)
    j = min(int((column + 0.5) * image.scale), image.depth_z.shape[1] - 1)
    rows = [("u, v", f"{column}, {row}")]
    for laser, light in zip(scene.lasers, image.laser, strict=True):
        rows.append((laser.name, f"about {light[i, j]:.3g} W/(m² sr)"))
    item = int(image.object_id[i, j])
    if item >= 0:
        rows.append(("depth", f"{1e3 * float(image.depth_z[i, j]):.2f} mm"))
        rows.append(("object", scene.visible_objects[item].name))
    return rows


def live_picture(project: Project, image: PreviewImage, paint: bool = False) -> Picture:
    """(h, w) a preview: grey shape for the eye, and each laser's line as bright as the sensor would see it.

    paint: as of `picture`.
    """
    small, sensor = scaled(project, image.scale), project.sensor
    frame = Frame(0, image.laser, None, (), _depth_alone(image))
    full = full_electrons(sensor)
    total = np.sqrt(image.shade) * np.float32(SHAPE_BRIGHTNESS)
    saturated = np.zeros(total.shape[:2], np.bool_)
    for i, laser in enumerate(project.scene.lasers):
        power = [item.power if k == i else 0.0 for k, item in enumerate(project.scene.lasers)]
        electrons = expected_electrons(frame, small.scene, small.sensor, laser_power=power)
        line = np.sqrt(np.minimum(electrons / np.float32(full), 1.0))
        saturated |= electrons >= full
        # pure hue hides how bright it is: half of it is white
        for band, share in enumerate(wavelength_colour(laser.wavelength_nm)):
            total[..., band] += np.float32(0.5 + 0.5 * share) * line
    drawn = colour(np.ascontiguousarray(total, np.float32), 1.0)
    return _painted(drawn, saturated) if paint else drawn


def _depth_alone(image: PreviewImage) -> Truth:
    """Of the truth of pixels what the sensor's defocus needs."""
    unknown = np.broadcast_to(np.float32(np.nan), (*image.depth_z.shape, 3))
    return Truth(image.depth_z, unknown[..., 0], unknown, unknown, image.object_id)


def _painted(drawn: Picture, where: NDArray[np.bool_]) -> Picture:
    drawn[where] = np.uint32(0xFF000000 | int(SATURATED[1:], 16))
    return drawn
