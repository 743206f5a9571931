"""Two finished runs side by side: what changed in their set-up, and which of their figures differ beyond chance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import ply_pieces
from analysis.study.difference import Difference, Errors, clear, differences
from render.base.errors import InputError
from studio.project.input_files import SHOWN
from studio.project.project import Project
from studio.scan.redevelop import light_path
from studio.scan.run_record import Points, read_run
from studio.scan.scan_folder import image_scale_of, measured_project, open_folder
from studio.study.changes import Change, changes

TEST_PAIRED = "jackknife over blocks of neighbouring rows, the same left out of both runs; Student's t"
TEST_APART = "jackknife over blocks of neighbouring rows, each run's own; Welch's t"


@dataclass(frozen=True)
class Run:
    """A finished scan, from its folder or from its report."""

    path: Path
    project: Project
    """As it was measured, at the image scale."""
    image_scale: float
    frames: int
    inputs: Mapping[str, str]
    versions: Mapping[str, str]
    """Of libraries; a folder does not tell them."""
    results: tuple[Mapping[str, Any], ...]
    errors: tuple[Errors, ...]
    """Of each laser by the project's method, depth, m; none: it was rendered alone."""


@dataclass(frozen=True)
class Figure:
    """One measure of one laser in both runs. scale: from SI to the unit shown."""

    laser: str
    label: str
    unit: str
    scale: float
    found: Difference
    clear: bool
    """Beyond chance, all figures of the comparison considered (Holm)."""


@dataclass(frozen=True)
class Comparison:
    setup: tuple[Change, ...]
    figures: tuple[Figure, ...]
    paired: bool
    """Row i of one run looks at the same place as row i of the other."""
    notes: tuple[str, ...]

    @property
    def test(self) -> str:
        return TEST_PAIRED if self.paired else TEST_APART


FIGURES = {
    "bias": ("depth bias", "um", 1e6),
    "sigma": ("depth sigma", "um", 1e6),
    "robust_sigma": ("depth sigma, robust", "um", 1e6),
    "rmse": ("depth error, RMS", "um", 1e6),
    "p95": ("depth error, P95", "um", 1e6),
    "measured": ("points on the line", "", 1.0),
    "completeness": ("completeness", "%", 100.0),
    "false": ("points without a line", "", 1.0),
}
"""Label, unit and scale of what is compared."""


def read_side(path: Path) -> Run:
    """The run at a path: a results folder, or a report.html. InputError: neither, or damaged."""
    if path.is_dir():
        return _of_folder(path)
    if path.suffix.lower() not in (".html", ".htm"):
        allowed = "a results folder, or a report.html"
        raise InputError("this is no finished run", where=str(path), allowed=allowed, cure="run the project first")
    found = read_run(path)
    said, lasers = found.record, len(found.project.scene.lasers)
    errors = tuple(_errors(found.points(laser)) for laser in range(lasers))
    return Run(path, found.project, said.image_scale, said.frames, said.inputs, said.versions, said.results, errors)


def compare_runs(a: Run, b: Run) -> Comparison:
    """Lasers are matched by their order, where the rigs have as many."""
    setup = [*changes(a.project, b.project), *_circumstances(a, b)]
    paired = _same_rows(a, b)
    notes, figures = [], []
    if len(a.errors) != len(b.errors) or not a.errors:
        notes.append("The results are not compared: " + _why_not(a, b))
    else:
        for laser, name in enumerate(one.name for one in b.project.scene.lasers):
            found = differences(a.errors[laser], b.errors[laser], paired=paired)
            share = _completeness(a, b, laser, found["measured"])
            found |= {"completeness": share} if share is not None else {}
            figures += [(name, *FIGURES[key], found[key]) for key in FIGURES if key in found]
    known = clear({str(i): row[-1].p for i, row in enumerate(figures)})
    told = tuple(Figure(*row, known[str(i)]) for i, row in enumerate(figures))
    if any(math.isnan(one.found.p) for one in told):
        notes.append("Where no interval is told, too few rows that err apart were measured.")
    if figures and not paired:
        notes.append("Geometry differs, so that rows of one run look at other places than those of the other.")
    return Comparison(tuple(setup), told, paired, tuple(notes))


def _of_folder(folder: Path) -> Run:
    found = open_folder(folder)
    results, points = found.manifest.get("results"), folder / "points.ply"
    errors: tuple[Errors, ...] = ()
    if isinstance(results, list) and results and points.is_file():
        lasers = len(found.project.scene.lasers)
        errors = _read_points(points, lasers)
    rows = tuple(row for row in results if isinstance(row, dict)) if isinstance(results, list) else ()
    scale, project = image_scale_of(found), measured_project(found)
    return Run(folder, project, scale, len(found.frames), found.inputs, {}, rows, errors)


def _read_points(path: Path, lasers: int) -> tuple[Errors, ...]:
    columns: dict[str, list[Any]] = {"step": [], "row": [], "laser": [], "error_depth": []}
    for piece in ply_pieces(path):
        missing = sorted(columns.keys() - piece.keys())
        if missing:
            raise InputError("the points lack columns", where=str(path), found=f"no {', '.join(missing)}")
        for name, parts in columns.items():
            parts.append(piece[name])
    step, row, laser, error = (np.concatenate(parts) for parts in columns.values())
    return tuple(_sorted(step[laser == i], row[laser == i], error[laser == i]) for i in range(lasers))


def _errors(points: Points) -> Errors:
    return _sorted(points["step"], points["row"], points["error"])


def _sorted(step: Any, row: Any, error: Any) -> Errors:
    return Errors(step.astype(np.int64), row.astype(np.int64), error.astype(np.float64))


def _same_rows(a: Run, b: Run) -> bool:
    """The same camera, lasers, shapes, poses and motion, to the last pixel; light and surfaces may differ."""
    return _geometry(a.project) == _geometry(b.project) and dict(a.inputs) == dict(b.inputs)


def _geometry(project: Project) -> Any:
    data = light_path(project.scene).model_dump(mode="json")
    for item in data["objects"]:
        item.pop("material")
        item["shape"].pop("sha256", None)
    camera = data["rig"]["camera"]
    camera.pop("lens")
    for laser in data["rig"]["lasers"]:
        for name in ("wavelength_nm", "fan_profile", "sheet"):
            laser.pop(name, None)
    return [data["rig"], data["objects"], data["motion"], project.extraction.axis]


def _completeness(a: Run, b: Run, laser: int, measured: Difference) -> Difference | None:
    """From the counts of points: rows to be seen are the same in number however often a scan is repeated."""
    rows = [_row(run, laser) for run in (a, b)]
    shares = [row.get("completeness") for row in rows]
    if not all(isinstance(share, float | int) for share in shares) or min(measured.a, measured.b) <= 0.0:
        return None
    first, second = (float(share) for share in shares)  # type: ignore[arg-type]
    per_point = 0.5 * (first / measured.a + second / measured.b)
    half = 0.5 * (measured.high - measured.low) * per_point
    change = second - first
    return Difference(first, second, change - half, change + half, measured.p, measured.blocks)


def _row(run: Run, laser: int) -> Mapping[str, Any]:
    """The results of the project's own method."""
    name = run.project.scene.lasers[laser].name
    return next((row for row in run.results if row.get("laser") == name), {})


def _circumstances(a: Run, b: Run) -> list[Change]:
    """What decides numbers beside the project."""
    found = []
    for field, label in (("image_scale", "Image scale"), ("frames", "Frames")):
        then, now = getattr(a, field), getattr(b, field)
        if then != now:
            found.append(Change(field, label, f"{then:g}", f"{now:g}"))
    for field, label, first, second in (
        ("inputs", "File", a.inputs, b.inputs),
        ("versions", "Version", a.versions, b.versions),
    ):
        if field == "versions" and not (first and second):
            continue
        for name in sorted({*first, *second}):
            if first.get(name) != second.get(name):
                shown = (str(one.get(name, "none"))[:SHOWN] for one in (first, second))
                found.append(Change(f"{field}[{name}]", f"{label}: {name}", *shown))
    return found


def _why_not(a: Run, b: Run) -> str:
    for run in (a, b):
        if not run.errors:
            return f"{run.path} holds frames alone, without points."
    return f"{len(a.errors)} laser(s) in {a.path}, {len(b.errors)} in {b.path}."
