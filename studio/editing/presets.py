"""Cameras, sensors, lasers and materials that come with the program, each with the source of its figures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

from render.base.errors import InputError
from render.camera.camera import Camera, Lens
from render.laser.laser import LineLaser
from render.scene.scene import SceneObject
from render.sensor.sensor import Sensor
from studio.editing.linked_fields import (
    with_focal_length,
    with_height,
    with_image_distance,
    with_pixel_pitch,
    with_width,
)
from studio.project.document import FieldPath, replaced, value_at
from studio.project.project import Project
from studio.project.strict_json import read_object

PresetKind = Literal["cameras", "sensors", "lasers", "materials"]
FOLDER = Path(__file__).resolve().parents[2] / "assets" / "presets"

CAMERA: FieldPath = ("scene", "rig", "camera")
SENSOR: FieldPath = ("sensor",)
NEAREST = 2.0
"""Focal lengths, at which the image is as large as the object."""


@dataclass(frozen=True)
class Preset:
    """values: fields by model ("camera", "sensor", "laser", "object"), as stored (SI); what is left out stays."""

    name: str
    source: str
    values: dict[str, dict[str, Any]]


@lru_cache
def presets(kind: PresetKind) -> tuple[Preset, ...]:
    """Those of one kind, in the order of the menu."""
    entries = read_object(FOLDER / f"{kind}.json", "presets file")["presets"]
    return tuple(
        Preset(entry["name"], entry["source"], {key: entry[key] for key in entry.keys() - {"name", "source"}})
        for entry in entries
    )


def preset_named(kind: PresetKind, name: str, where: str) -> Preset:
    """The preset of that name, or the only one that has it as a part; case does not matter. InputError: none, several.

    where: what asked for it.
    """
    wanted = name.strip().lower()
    found = [preset for preset in presets(kind) if preset.name.lower() == wanted]
    found = found or [preset for preset in presets(kind) if wanted and wanted in preset.name.lower()]
    if len(found) != 1:
        allowed = ", ".join(preset.name for preset in found or presets(kind))
        what = f"several {kind} have that in their name" if found else f"there is no such preset of {kind}"
        raise InputError(what, where=where, found=name, allowed=allowed)
    return found[0]


def presets_for(project: Project, path: FieldPath) -> tuple[Preset, ...]:
    """Those that fit the item at a path."""
    item = value_at(project, path)
    kinds: dict[type, PresetKind] = {
        Camera: "cameras",
        Sensor: "sensors",
        LineLaser: "lasers",
        SceneObject: "materials",
    }
    kind = kinds.get(type(item))
    return presets(kind) if kind else ()


def leaves_focus_open(preset: Preset) -> bool:
    """It is of a lens that its source does not say the focus of."""
    return "focal_length" in (camera := preset.values.get("camera", {})) and camera.get("focus_distance") is None


def with_preset(project: Project, path: FieldPath, preset: Preset, focus: float | None = None) -> Project:
    """The project with a preset's values: the laser's or object's at `path`, the camera's and sensor's at their place.

    Poses, names and exposure stay. A sensor without a lens keeps the camera's image distance. focus: m, of a lens whose
    preset leaves it open; far away at less than a lens can be focused at. InputError: does not fit.
    """
    for at_path in preset.values.keys() & {"laser", "object"}:
        project = _merged(project, path, preset.values[at_path])
    if "camera" in preset.values:
        values = preset.values["camera"]
        if focus is not None and leaves_focus_open(preset) and focus > NEAREST * values["focal_length"]:
            values = values | {"focus_distance": focus}
        camera = with_camera_values(project.scene.camera, values, own_focal_length=leaves_focus_open(preset))
        project = _merged(project, CAMERA, camera)
    if "sensor" in preset.values:
        project = _merged(project, SENSOR, preset.values["sensor"])
    return project


def with_camera_values(camera: Camera, values: dict[str, Any], own_focal_length: bool = False) -> dict[str, Any]:
    """Fields of the camera for width, height, pixel_pitch, focal_length (all m or px), f_number, focus_distance.

    own_focal_length: that of the lens, which is farther from its image when it is focused, and not the image distance.
    Another sensor or lens has another distortion, so with a focal length it is cleared and the centre centred.
    """
    changed = camera
    lens = {name: values[name] for name in values.keys() & Lens.model_fields.keys()}
    if lens:
        changed = changed.model_copy(update={"lens": camera.lens.model_copy(update=lens)})
    if "focal_length" in values:
        changed = changed.model_copy(update={"distortion": (), "skew": 0.0, "fy": changed.fx})
        changed = changed.model_copy(update={"cx": (camera.width - 1) / 2, "cy": (camera.height - 1) / 2})
    steps: tuple[tuple[Any, Any], ...] = (
        (with_width, values.get("width", camera.width)),
        (with_height, values.get("height", camera.height)),
        (with_pixel_pitch, values.get("pixel_pitch", camera.pixel_pitch)),
        (with_focal_length, values["focal_length"])
        if own_focal_length
        else (with_image_distance, values.get("focal_length", camera.image_distance)),
    )
    for step, value in steps:
        changed = changed.model_copy(update=step(changed, value))
    return {name: getattr(changed, name) for name in Camera.model_fields}


def _merged(project: Project, path: FieldPath, values: dict[str, Any]) -> Project:
    item = value_at(project, path)
    return replaced(project, path, {name: getattr(item, name) for name in type(item).model_fields} | values)
