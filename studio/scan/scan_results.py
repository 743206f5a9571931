"""A finished scan to look at: its frames one at a time, the statistics of all, a sample of its points. Qt-free."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import INTEGERS, Cloud, ply_pieces
from render.base.arrays import Float
from render.base.errors import InputError
from render.base.threads import Cancel
from render.frame import Frame
from render.output.frame_files import read_frame
from render.run import never
from render.scene.settings import RenderSettings
from render.scene.shape import MeshFile
from render.world.world import World
from studio.project.input_files import check_unchanged
from studio.project.project import READ_OFF, Project
from studio.scan.point_sample import PointSample
from studio.scan.result_series import MEASURED, OUTLIERS, ErrorView
from studio.scan.scan_folder import (
    MANIFEST,
    PROJECT,
    ScanFolder,
    check_frame,
    check_kept,
    image_scale_of,
    is_project,
    measured_project,
)
from studio.scan.stages import scaled, step_world

LARGEST = 1e12
MOST_FILES = 50
"""Project files of a folder that are looked at for the one that was scanned."""
COLUMNS = {"depth": "error_depth", "surface": "error_surface"}
"""Kind of error -> the column of the points that holds it; the error in the image is not among them."""
NEEDED = {name: "i" if name in INTEGERS else "f" for name in ("x", "y", "z", *INTEGERS, *COLUMNS.values())}
"""Columns without which points cannot be shown, and their kind of number."""
FIGURES = {"depth": "depth_m", "surface": "surface_error_m", "position": "line_px"}
"""Kind of error -> its entry in a row of the manifest's results."""
FORMER_SURFACE = "surface_m"
"""The surface's in older manifests: positive is towards the camera there."""


@dataclass(frozen=True)
class ScanResults:
    """What is held of a scan, however long it is."""

    found: ScanFolder
    image_scale: float
    """Of its images, to the scanner's."""
    points: Cloud
    """A sample, by the project's method, at the pose of the first step; no points where none were measured."""
    sums: dict[str, Float]
    """Kind of error -> (lasers, steps, 3): number, sum and sum of squares of the errors, m."""
    one_in: int = 1
    """Of how many points `points` has one."""

    @cached_property
    def measured_as(self) -> Project:
        """The project with the settings of the last measurement. InputError: as `measured_project`."""
        return measured_project(self.found)

    @property
    def count(self) -> int:
        """Steps there are."""
        return len(self.found.frames)

    @property
    def measured(self) -> bool:
        """There are statistics of all steps; a scan may have been rendered alone."""
        return bool(self.found.manifest.get("results"))

    @property
    def report(self) -> Path | None:
        """The report for a browser, where one was written."""
        names = self.found.manifest.get("report")
        page = self.found.folder / "report.html"
        return page if isinstance(names, list) and page.name in names and page.is_file() else None

    def read_step(self, step: int, before: World | None) -> tuple[Frame, World]:
        """Frame and placed triangles of a step; before: those of another step. InputError: not there, or damaged."""
        path = self.found.frames[step]
        check_frame(self.found, path)
        frame = read_frame(path)
        if frame.step != step:
            raise InputError("the frame is of another step", where=str(path), found=frame.step, allowed=str(step))
        return frame, step_world(self.found.project, self.found.root, step, before)

    def by_step(self, laser: int, kind: str) -> tuple[Float, Float]:
        """(steps,) mean error and RMSE of each step, m; NaN where there is none."""
        number, total, squares = self.sums[kind][laser].T if kind in self.sums else np.zeros((3, self.count))
        with np.errstate(invalid="ignore", divide="ignore"):
            return total / number, np.sqrt(squares / number)

    def table(self, laser: int, view: ErrorView) -> tuple[list[str], list[tuple[str, str, list[float]]]]:
        """Methods, and rows as of `result_series.table`, of all steps; NaN: the manifest does not say."""
        scene = self.found.project.scene
        name = scene.lasers[laser].name if laser < len(scene.lasers) else ""
        written = self.found.manifest.get("results")
        rows = [row for row in written if isinstance(row, dict)] if isinstance(written, list) else []
        rows = [row for row in rows if row.get("laser") == name and isinstance(row.get("method"), str)]
        figures = [_figures(row, view.kind) for row in rows]
        points = [_number(row, "points") for row in rows]
        found: list[tuple[str, str, list[float]]] = []
        for title, key in MEASURED:
            values = [_sigma(each) if key == "sigma" else _number(each, key) for each in figures]
            found.append((title, view.unit, [view.scale * value for value in values]))
        found += [
            ("Points", "", points),
            ("Completeness", "%", [100.0 * _number(row, "completeness") for row in rows]),
            ("False scan lines", "", [_number(row, "false_scan_lines") for row in rows]),
        ]
        shares = [_number(row, "outliers") / n if n else math.nan for row, n in zip(rows, points, strict=True)]
        found.append((OUTLIERS["position"], "%", [100.0 * share for share in shares]))
        return [row["method"] for row in rows], found

    def remarks(self) -> list[str]:
        """What the scan noted of itself and of its errors."""
        kept = [self.found.manifest.get(key) for key in ("notes", "extraction", "remarks")]
        return [text for texts in kept if isinstance(texts, list) for text in texts if isinstance(text, str)]


def holds_scan(path: Path) -> Path | None:
    """The folder of a scan meant by a path: the folder, or a file of the scan itself; None: it is something else."""
    folder = path if path.is_dir() else path.parent if path.name in (MANIFEST, PROJECT) else None
    if folder is None or (path.name == MANIFEST and is_project(path)):
        return None
    finished = (folder / MANIFEST).is_file() and not is_project(folder / MANIFEST)
    return folder if finished or (folder / PROJECT).is_file() else None


def read_results(found: ScanFolder, cancelled: Cancel = never) -> ScanResults:
    """Go once through the scan's points, a piece at a time.

    InputError: they are damaged, an input file changed, or the scan kept no frames to look at.
    """
    check_kept(found)
    cure = "restore them, or run the project again"
    check_unchanged(found.inputs, found.project.scene, found.root, cure=cure)
    path = found.folder / "points.ply"
    lasers, steps = len(found.project.scene.lasers), len(found.frames)
    sums = {kind: np.zeros((lasers, steps, 3)) for kind in COLUMNS}
    sample = PointSample()
    for piece in ply_pieces(path) if path.exists() else ():
        if cancelled():
            break
        missing = sorted(name for name, kind in NEEDED.items() if name not in piece or piece[name].dtype.kind != kind)
        if missing:
            raise InputError("the points lack columns", where=str(path), found=f"no {', '.join(missing)}")
        _add(sums, piece)
        sample.add(piece)
    return ScanResults(found, image_scale_of(found), sample.points, sums, sample.one_in)


def is_scan_of(found: ScanFolder, project: Project) -> bool:
    """The scan is of this project, brought to the scan's image scale."""
    return _comparable(scaled(project, image_scale_of(found))) == _comparable(found.project)


def source_of(found: ScanFolder) -> Path | None:
    """The project file that the scan was made from, if it still says the same: where its meshes are, or beside the
    scan, where a project that was saved only after it is likely to be."""
    folders = dict.fromkeys((found.root.resolve(), found.folder.resolve().parent))
    files = [sorted(one.glob("*.json"), key=lambda file: (file.name != "project.json", file.name)) for one in folders]
    for file in chain.from_iterable(some[:MOST_FILES] for some in files):
        try:
            if is_scan_of(found, Project.load(file)):
                return file
        except InputError:
            continue
    return None


def is_unfinished(folder: Path, project: Project) -> bool:
    """The folder holds the beginning of a scan of this project, which is at the scan's image scale."""
    if (folder / MANIFEST).exists() or not (folder / PROJECT).is_file():
        return False
    try:
        return _comparable(Project.load(folder / PROJECT)) == _comparable(project)
    except InputError:
        return False


def _comparable(project: Project) -> Project:
    """Without what changes no point: the name, how well it is rendered, and mesh digests, which only files have."""
    objects = tuple(
        item.model_copy(update={"shape": item.shape.model_copy(update={"sha256": None})})
        if isinstance(item.shape, MeshFile)
        else item
        for item in project.scene.objects
    )
    scene = project.scene.model_copy(update={"objects": objects})
    return project.model_copy(
        update={
            "name": "project",
            "scene": scene,
            "render": RenderSettings(),
            "seed": 0,
            **{name: Project.model_fields[name].default for name in READ_OFF},
        }
    )


def _add(sums: dict[str, Float], piece: Cloud) -> None:
    """Add the errors of a piece to the sums of its steps; points of no laser or step of the scan are left out."""
    for kind, name in COLUMNS.items():
        lasers, steps, _ = sums[kind].shape
        laser, step, error = piece["laser"], piece["step"], piece[name]
        here = np.isfinite(error) & (laser >= 0) & (laser < lasers) & (step >= 0) & (step < steps)
        cell = laser[here].astype(np.int64) * steps + step[here]
        for k in range(3):
            weights = error[here] ** k
            sums[kind][..., k] += np.bincount(cell, weights, lasers * steps).reshape(lasers, steps)


def _number(row: dict[str, Any], key: str) -> float:
    """NaN: it is no number, or none that a table can show."""
    value = row.get(key)
    return float(value) if isinstance(value, int | float) and abs(value) < LARGEST else math.nan


def _figures(row: dict[str, Any], kind: str) -> dict[str, Any]:
    """Of a kind of error; nothing where there is none."""
    found, former = row.get(FIGURES[kind]), row.get(FORMER_SURFACE)
    if kind == "surface" and found is None and isinstance(former, dict):
        return {**former, "bias": -_number(former, "bias")}
    return found if isinstance(found, dict) else {}


def _sigma(figures: dict[str, Any]) -> float:
    """The spread about the mean: what the RMSE has beyond the bias."""
    bias, rmse = _number(figures, "bias"), _number(figures, "rmse")
    return math.sqrt(max(rmse**2 - bias**2, 0.0)) if math.isfinite(bias + rmse) else math.nan
