"""Renders kept with the project: in its folder, by their names, with settings, figures and every bit of their light.

PROJECT'S FOLDER/renders/NAME/  render.exr, render.json, project.json, and kept.json, which is written last
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeGuard

from analysis.gauges.read import Reading
from render.base.errors import InputError
from render.base.files import atomic_write
from render.frame import Frame
from render.output.frame_files import read_frame, write_frame
from studio.project.date_and_time import now
from studio.project.input_files import check_unchanged, input_hashes
from studio.project.project import Project
from studio.project.strict_json import read_object
from studio.scan.stages import Measurement, scaled_sensor

FOLDER, RECORD, STEM, PROJECT = "renders", "kept.json", "render", "project.json"
FORMAT, VERSION = "blazer-render", 1
FIGURES = {
    "Depth RMSE": "µm",
    "Depth bias": "µm",
    "Depth sigma": "µm",
    "Depth robust sigma": "µm",
    "Off the surface, RMSE": "µm",
    "Line RMSE": "px",
    "Completeness": "%",
}
"""Name -> unit, as they are shown."""
VALUES = ("value", "sigma_random", "sigma_systematic", "truth")
"""Of a reading, its numbers: m, of an angle rad, of an area m^2."""
MOST_KEPT = 500


@dataclass(frozen=True)
class Kept:
    """A render as a row of the table."""

    name: str
    created: str
    project: Project
    """As it was rendered, at its image scale; all that measures and reads off is as its figures were made."""
    image_scale: float
    """Of the image, to the scanner's."""
    figures: dict[str, float]
    """By the names of `FIGURES`, in their units; NaN or missing: not measured."""
    folder: Path | None = None
    """None: it is in this session alone."""
    readings: tuple[Reading, ...] = ()
    """Of the measures that `project` has."""
    laser_power: tuple[float, ...] = ()
    """W, of each laser, with which it was measured; none: as it was rendered, which its light is of."""
    stopped: bool = False
    """Before it was finished, so that light is missing."""


def figures_of(found: Sequence[Measurement]) -> dict[str, float]:
    """Of a frame's measurements by one method, all its lasers together: root of the mean squares, mean of the rest."""
    if not found:
        return {}

    def mean(values: list[float]) -> float:
        known = [value for value in values if math.isfinite(value)]
        return sum(known) / len(known) if known else math.nan

    def root(values: list[float]) -> float:
        return math.sqrt(mean([value**2 for value in values]))

    errors = [one.errors for one in found]
    return {
        "Depth RMSE": 1e6 * root([one.depth_z.rmse for one in errors]),
        "Depth bias": 1e6 * mean([one.depth_z.bias for one in errors]),
        "Depth sigma": 1e6 * root([one.depth_z.sigma for one in errors]),
        "Depth robust sigma": 1e6 * root([one.depth_z.robust_sigma for one in errors]),
        "Off the surface, RMSE": 1e6 * root([one.surface.rmse for one in errors]),
        "Line RMSE": root([one.u.rmse for one in errors]),
        "Completeness": 100.0 * mean([one.completeness for one in errors]),
    }


def keep(root: Path, what: Kept, frame: Frame) -> Kept:
    """Write a render below the project's folder; gives it with its folder.

    root: the project's folder, where its meshes are. InputError: the name is empty, or files cannot be written.
    """
    stem = re.sub(r"[^\w \-.]+", "_", what.name).strip(" .")[:80]
    if not stem:
        raise InputError("a render that is kept needs a name", cure="name it first")
    folder, number = root / FOLDER / stem, 1
    while folder.exists():
        number += 1
        folder = root / FOLDER / f"{stem} {number}"
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        raise InputError("the folder cannot be made", where=str(folder), found=error.strerror or error) from error
    write_frame(folder, STEM, frame, None, what.project.scene, sensor=what.project.sensor)
    with atomic_write(folder / PROJECT) as temporary:
        temporary.write_text(what.project.to_text(), encoding="utf-8")
    created = what.created or now()
    record = {
        "format": FORMAT,
        "format_version": VERSION,
        "name": what.name,
        "created": created,
        "image_scale": what.image_scale,
        "laser_power": list(what.laser_power),
        "stopped": what.stopped,
        "figures": {name: value if math.isfinite(value) else None for name, value in what.figures.items()},
        "measures": {one.gauge.name: _written(one) for one in what.readings},
        "inputs": input_hashes(what.project.scene, root),
    }
    with atomic_write(folder / RECORD) as temporary:
        temporary.write_text(json.dumps(record, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return replace(what, created=created, folder=folder)


def as_read_now(kept: Kept, project: Project) -> Kept:
    """With what its readings say of the measures that a project has now; one that was defined otherwise has none."""
    if kept.project.measured_in != project.measured_in:
        return replace(kept, readings=())
    found = [replace(one, gauge=now) for now in project.measures for one in kept.readings if now.reads_as(one.gauge)]
    return replace(kept, readings=tuple(found))


def kept_renders(root: Path) -> tuple[list[Kept], list[str]]:
    """Those of a project's folder in the order of their making, and what is wrong with others there."""
    found, wrong = [], []
    for record in sorted((root / FOLDER).glob(f"*/{RECORD}"))[:MOST_KEPT]:
        try:
            found.append(_read(record))
        except InputError as error:
            wrong.append(str(error))
    return sorted(found, key=lambda one: one.created), wrong


def open_kept(kept: Kept, root: Path) -> Frame:
    """The light of a kept render, bit for bit. InputError: it is not there, damaged, or a mesh has changed since."""
    folder = _folder(kept)
    record = read_object(folder / RECORD, "kept render")
    inputs = record.get("inputs")
    cure = "restore the files, or render again"
    check_unchanged(inputs if isinstance(inputs, dict) else {}, kept.project.scene, root, cure=cure)
    return read_frame(folder / f"{STEM}.json")


def at_full_scale(kept: Kept, now: Project) -> Project:
    """The scanner that a kept render is of; its camera is that of the project now, where that has its image as well."""
    if kept.image_scale == 1.0:
        return kept.project
    small, its = kept.project.scene.camera, now.scene.camera
    whole = its.model_copy(update={"lens": small.lens})
    if whole.scaled(kept.image_scale) != small:  # sides are rounded, so that this one may be a pixel off
        whole = small.scaled(1.0 / kept.image_scale)
    scene = kept.project.scene
    rig = scene.rig.model_copy(update={"camera": whole})
    update = {
        "scene": scene.model_copy(update={"rig": rig}),
        "sensor": scaled_sensor(kept.project.sensor, 1.0 / kept.image_scale),
        "calibration": kept.project.calibration.scaled(1.0 / kept.image_scale, whole),
    }
    return kept.project.model_copy(update=update)


def rename(kept: Kept, name: str) -> None:
    """Call a kept render otherwise; its folder stays. InputError: it is not there, damaged, or cannot be written."""
    record = read_object(_folder(kept) / RECORD, "kept render")
    with atomic_write(_folder(kept) / RECORD) as temporary:
        temporary.write_text(json.dumps(record | {"name": name}, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def remove(kept: Kept) -> None:
    """Take a kept render's files off the disk; others that lie beside them stay. InputError: one cannot be removed."""
    folder = _folder(kept)
    try:
        # the record first: what is left of a removal that fails is no kept render
        for name in (RECORD, PROJECT, f"{STEM}.json", f"{STEM}.exr"):
            (folder / name).unlink(missing_ok=True)
        if folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
    except OSError as error:
        raise InputError("a file cannot be removed", where=str(folder), found=error.strerror or error) from error


def _folder(kept: Kept) -> Path:
    if kept.folder is None:
        raise InputError("the render was not kept", where=kept.name)
    return kept.folder


def _read(path: Path) -> Kept:
    record: dict[str, Any] = read_object(path, "kept render")
    if record.get("format") != FORMAT or record.get("format_version") != VERSION:
        raise InputError("not a kept render of this version", where=str(path))
    name, created, scale, figures = (record.get(key) for key in ("name", "created", "image_scale", "figures"))
    if not (isinstance(name, str) and isinstance(created, str) and isinstance(figures, dict)):
        raise InputError("a damaged kept render", where=str(path))
    if isinstance(scale, bool) or not isinstance(scale, int | float) or not 0.01 <= scale <= 4.0:
        raise InputError("a damaged kept render", where=str(path))
    numbers = {key: _number(value) for key, value in figures.items() if key in FIGURES}
    project = Project.load(path.parent / PROJECT)
    power, stopped = record.get("laser_power"), record.get("stopped") is True
    powers = tuple(map(float, power)) if _are_powers(power, len(project.scene.lasers)) else ()
    readings = _readings(record.get("measures"), project)
    return Kept(name, created, project, float(scale), numbers, path.parent, readings, powers, stopped)


def _written(one: Reading) -> dict[str, Any]:
    values = {name: getattr(one, name) for name in VALUES}
    told = {name: value if math.isfinite(value) else None for name, value in values.items()}
    return {**told, "step": one.step, "points": one.points, "reason": one.reason, "remark": one.remark}


def _readings(found: Any, project: Project) -> tuple[Reading, ...]:
    """Of the project's measures, what was read when it was kept."""
    records = found if isinstance(found, dict) else {}
    return tuple(
        Reading(
            gauge,
            record["step"] if isinstance(record.get("step"), int) else None,
            **_numbers(record),
            points=record["points"] if isinstance(record.get("points"), int) else 0,
            reason=str(record.get("reason", "")),
            remark=str(record.get("remark", "")),
        )
        for gauge in project.measures
        if isinstance(record := records.get(gauge.name), dict)
    )


def _numbers(record: dict[str, Any]) -> dict[str, Any]:
    """Of VALUES."""
    return {name: _number(record.get(name)) for name in VALUES}


def _number(found: Any) -> float:
    """NaN where there is none."""
    return float(found) if isinstance(found, int | float) and not isinstance(found, bool) else math.nan


def _are_powers(found: Any, count: int) -> TypeGuard[list[float]]:
    return isinstance(found, list) and len(found) == count and all(isinstance(one, float | int) for one in found)
