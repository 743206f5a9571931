"""What a report holds of the run that it tells of, as data: enough to run it again to the same bits, and to compare.

It stands in the page as text of an inert element, which no browser runs or shows.
"""

from __future__ import annotations

import base64
import binascii
import html
import json
import platform
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, ValidationError

from analysis.report.record import ScanRecord
from analysis.report.sample import IMAGE
from analysis.report.total import total
from render.base.errors import InputError
from render.base.files import inside, read_bytes, sha256
from render.base.model import Model
from studio.project.input_files import listed
from studio.project.project import Project
from studio.project.strict_json import parse_object, read_object
from studio.project.validation_messages import input_error
from studio.scan.results import METHODS, versions
from studio.scan.scan_folder import MANIFEST
from studio.scan.summary import summarise

MAX_BYTES = 256 * 2**20
MOST_LINES = 1 << 15
"""Points of a laser that a report holds the errors of; of a longer scan only every so many steps."""
MOST_POINTS = 1 << 24
POINT = np.dtype([("step", "<i4"), ("row", "<i4"), ("error", "<f8")])
ELEMENT = re.compile(r'<template id="blazer-run">([^<]*)</template>')
Digest = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
Points = NDArray[np.void]
"""(m,) of `POINT`: depth error, m, NaN where there is no truth."""


class RunRecord(Model):
    """As it stands in the page, beside the project itself, which is checked as any other."""

    format: Literal["blazer-run"] = "blazer-run"
    format_version: Literal[1] = 1
    image_scale: float = Field(gt=0.0, le=4.0)
    frames: int = Field(ge=1, le=1_000_000)
    finished: bool
    """No frame's light was ended by the clock, which no second run would do alike."""
    inputs: dict[str, Digest]
    """SHA-256 of every mesh and texture, by its path from the project's folder."""
    versions: dict[str, str]
    machine: str
    results: tuple[dict[str, Any], ...]
    """As `summarise` gives them."""
    points: tuple[str, ...]
    """Of each laser, by the project's method: `POINT`s, zlib, base64."""


@dataclass(frozen=True)
class Recorded:
    """A report's run."""

    project: Project
    """As it was run: at the image scale, with its seed."""
    record: RunRecord
    path: Path

    def points(self, laser: int) -> Points:
        """(m,) InputError: the data are damaged."""
        try:
            packed = base64.b64decode(self.record.points[laser], validate=True)
            data = zlib.decompressobj().decompress(packed, MOST_POINTS * POINT.itemsize)
            return np.frombuffer(data, POINT)
        except (IndexError, ValueError, binascii.Error, zlib.error):
            raise InputError("the report's record of its points is damaged", where=str(self.path)) from None


def run_text(
    project: Project, record: ScanRecord, *, image_scale: float, inputs: Mapping[str, str], finished: bool
) -> str:
    """The text for the page: ASCII, one line of JSON. project: as it was run, at the image scale.

    Of methods that a second run does not compare with, which a person may have added in the window, nothing is held.
    """
    again = {*METHODS, *(total(record.chosen(laser)).method for laser in range(len(record.scene.lasers)))}
    said = RunRecord(
        image_scale=image_scale,
        frames=len(record.steps),
        finished=finished,
        inputs=dict(inputs),
        versions=versions(),
        machine=platform.machine(),
        results=tuple(one for one in summarise(record) if one["method"] in again),
        points=tuple(_packed(record, laser) for laser in range(len(record.scene.lasers))),
    )
    whole = {**said.model_dump(mode="json"), "project": project.model_dump(mode="json")}
    return json.dumps(whole, separators=(",", ":"), allow_nan=False)


def ended_by_clock(light: Any) -> bool:
    """By what a manifest tells of its frames' light: some of it neither reached its error nor spent its work."""
    frames = [frame for frame in light if isinstance(frame, dict)] if isinstance(light, list) else []
    groups = [group for frame in frames if isinstance(frame.get("groups"), list) for group in frame["groups"]]
    return any(isinstance(group, dict) and group.get("reason") == "unfinished" for group in groups)


def read_run(path: Path) -> Recorded:
    """The run that a report tells of. InputError: it is no report, an old one, or its record is damaged."""
    try:
        text = read_bytes(path, MAX_BYTES, "report").decode("utf-8")
    except UnicodeDecodeError:
        raise InputError("this is no report", where=str(path), allowed="report.html of a scan") from None
    found = ELEMENT.findall(text)
    if len(found) != 1:
        raise InputError(
            "the page does not say what was run",
            where=str(path),
            found=f"{len(found)} records",
            allowed="a report.html with one",
            cure="older reports, and those of frames developed with another laser power, have none: run the project",
        )
    data = parse_object(html.unescape(found[0]), str(path), "report's record")
    project = data.pop("project", None)
    if not isinstance(project, dict):
        raise InputError("the report's record holds no project", where=str(path), found=type(project).__name__)
    try:
        record = RunRecord.model_validate_json(json.dumps(data), strict=True)
    except ValidationError as error:
        raise input_error(error, RunRecord, data, str(path)) from None
    return Recorded(Project.from_data(project, f"{path}: project"), record, path)


def input_root(found: Recorded, given: Path | None) -> Path:
    """The folder that has the run's meshes and textures: `given`, else the report's own or its scan's project folder.

    Each file must have the hash that it had then. InputError: one is not there or is another; it is named.
    """
    beside = found.path.resolve().parent
    places = [given] if given is not None else [beside, *_scanned_from(beside)]
    told = [_unlike(found.record.inputs, place) for place in places]
    for place, wrong in zip(places, told, strict=True):
        if not wrong:
            return place
    raise InputError(
        f"the files that the report was made from are not here: {listed(told[-1])}",
        where=", ".join(str(place) for place in places),
        allowed="the same files at the same paths as then",
        cure="say with --root which folder holds them",
    )


def other_figures(then: Sequence[Mapping[str, Any]], now: Sequence[Mapping[str, Any]]) -> list[str]:
    """Figures of a record that a second run does not give to the bit; it may have measured by further methods."""
    told = {f"{one['laser']}, {one['method']}": one for one in now}
    rows = {f"{one.get('laser')}, {one.get('method')}": one for one in then}
    return unequal(rows, {name: told.get(name) for name in rows})


def unequal(then: Any, now: Any, place: str = "") -> list[str]:
    """Places at which two results differ, to the bit."""
    if isinstance(then, dict) and isinstance(now, dict) and then.keys() == now.keys():
        return [one for key in then for one in unequal(then[key], now[key], f"{place}.{key}".lstrip("."))]
    if isinstance(then, list | tuple) and isinstance(now, list | tuple) and len(then) == len(now):
        return [one for i, pair in enumerate(zip(then, now, strict=True)) for one in unequal(*pair, f"{place}[{i}]")]
    return [] if then == now else [f"{place}: {now}, then {then}"]


def _packed(record: ScanRecord, laser: int) -> str:
    rows = record.chosen(laser, 0).rows
    rows = rows[rows["valid"]]
    image = rows["index"] // IMAGE // max(len(record.scene.lasers), 1)
    every = max(1, -(-len(rows) // MOST_LINES))
    kept = image % every == 0
    points = np.empty(int(np.count_nonzero(kept)), POINT)
    points["step"] = np.array([one.step for one in record.steps])[image[kept]] if len(points) else 0
    points["row"], points["error"] = rows["index"][kept] % IMAGE, rows["depth"][kept]
    return base64.b64encode(zlib.compress(points.tobytes(), 9)).decode("ascii")


def _scanned_from(folder: Path) -> Sequence[Path]:
    """The project's folder, where a scan's manifest beside the report names it."""
    if not (folder / MANIFEST).is_file():
        return ()
    source = read_object(folder / MANIFEST, "scan manifest").get("project_folder")
    return ((folder / source).resolve(),) if isinstance(source, str) and "\0" not in source else ()


def _unlike(inputs: Mapping[str, str], root: Path) -> list[str]:
    """The files below `root` that are not those of the record, and why. InputError: a path leaves it."""
    wrong = []
    for name, then in inputs.items():
        file = inside(root, name, "report: input files")
        if not file.is_file():
            wrong.append(f"{name} (missing)")
        elif sha256(file) != then:
            wrong.append(f"{name} (changed since)")
    return wrong
