"""What one worker does: render once, then measure every cell that shares the render."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.gauges.read import read
from render.base.errors import InputError
from render.base.threads import Cancel
from studio.notebook.frame import RenderedFrame, render
from studio.notebook.measuring import (
    ExtractedLine,
    PointErrors,
    TriangulatedPoints,
    compare,
    develop,
    extract,
    triangulate,
)
from studio.project.project import Project
from studio.scan.gauging import profiles
from studio.scan.stages import Measurement
from studio.study.measures import MEASURES, measures, of_the_part
from studio.study.ray_units import RAY_SPEED, rays_per_second

Row = tuple[str, dict[str, Any], dict[str, float]]


@dataclass(frozen=True)
class Task:
    """A render and the cells that share it, as text, so that any process or machine can take it."""

    folder: str
    """Where the base project's meshes and textures are."""
    image_scale: float
    laser: int
    cells: tuple[tuple[str, str], ...]
    """Key and project, JSON, of each."""


def measure_task(task: Task, cancelled: Cancel = lambda: False) -> list[Row]:
    """Rows of a task's cells: key, measures, processor seconds. One thread: the caller shares tasks out.

    cancelled: asked often; then Cancelled, without rows. A cell that cannot be measured (nothing to see, an image of
    nothing) is a row of NaN with the `reason`; the rest of a study goes on.
    """
    rows: list[Row] = []
    projects = [Project.from_text(text).in_folder(Path(task.folder)) for _, text in task.cells]
    before = time.process_time()
    try:
        frame = render(projects[0], image_scale=task.image_scale, threads=1, cancelled=cancelled)
    except InputError as error:
        return [(key, _nothing(str(error)), {}) for key, _ in task.cells]
    rendering = time.process_time() - before
    for (key, _), project in zip(task.cells, projects, strict=True):
        started = time.process_time()
        try:
            power = project.scene.lasers[task.laser].power
            image = develop(frame, laser=task.laser, sensor=project.sensor, power=power, threads=1)
            developed = time.process_time()
            line = extract(image, settings=project.extraction, threads=1)
            extracted = time.process_time()
            points = triangulate(line)
            errors = compare(points, frame)
            found = measures(line, points, errors, frame.curves[task.laser])
            found |= _of_the_part(project, frame, line, points, errors)
        except InputError as error:
            rows.append((key, _nothing(str(error)), {"seconds_render": rendering, RAY_SPEED: rays_per_second()}))
            continue
        seconds = {
            "seconds_render": rendering,
            "seconds_develop": developed - started,
            "seconds_extract": extracted - developed,
            RAY_SPEED: rays_per_second(),
        }
        rows.append((key, {**found, "reason": ""}, seconds))
    return rows


def _of_the_part(
    project: Project, frame: RenderedFrame, line: ExtractedLine, points: TriangulatedPoints, errors: PointErrors
) -> dict[str, float]:
    """The project's measures of this laser's profile."""
    gauges = [one for one in project.measures if one.laser == points.laser and one.step in (None, frame.step)]
    if not gauges or line.image is None:
        return {}
    found = Measurement(frame.step, points.laser, line.image, line, points, errors)
    both = profiles(frame.project, frame, found)
    return of_the_part([read(gauge, frame.step, *both) for gauge in gauges])


def _nothing(reason: str) -> dict[str, Any]:
    return {**{name: float("nan") for name in MEASURES}, "reason": reason}


def warm_up(project: Project) -> None:
    """Compile or load the kernels that measuring takes, so that no cell's seconds hold them."""
    rays_per_second()
    small = project.model_copy(update={"render": project.render.model_copy(update={"laser_error": 0.3})})
    frame = render(small, image_scale=0.05, threads=1)
    for _ in range(2):
        compare(triangulate(extract(develop(frame, threads=1), threads=1)), frame)


def tasks(cells: Sequence[Any], image_scale: float, laser: int) -> list[Task]:
    """Cells grouped by render, in the order of their first."""
    groups: dict[str, list[Any]] = {}
    for cell in cells:
        groups.setdefault(cell.render_key, []).append(cell)
    return [
        Task(
            str(group[0].project.folder.resolve()),
            image_scale,
            laser,
            tuple((cell.key, cell.project.to_text()) for cell in group),
        )
        for group in groups.values()
    ]
