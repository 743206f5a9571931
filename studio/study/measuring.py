"""What one worker does: render once, then measure every cell that shares the render."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.gauges.read import read
from analysis.line.settings import Method
from render.base.errors import InputError
from render.base.threads import Cancel
from render.sensor.sensor import Sensor
from studio.notebook.frame import RenderedFrame, render
from studio.notebook.measuring import (
    DevelopedImage,
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
from studio.scan.stages import Measurement, scaled_sensor
from studio.study.boards import Boards
from studio.study.kept import ERRORS, on_the_line, picture, profile
from studio.study.kept import ROW as KEPT_ROW
from studio.study.measures import MEASURES, measures, of_the_part
from studio.study.ray_units import RAY_SPEED, rays_per_second
from studio.study.render_cache import forget, rendered
from studio.study.round_bodies import facet_error
from studio.study.tables import CALIBRATING
from studio.study.tasks import Task, Work

if TYPE_CHECKING:
    from studio.study.calibrating import Found

Row = tuple[str, dict[str, Any], dict[str, float]]


def measure_task(task: Task, cancelled: Cancel = lambda: False) -> list[Row]:
    """Rows of a task's cells: key, measures, processor seconds. One thread: the caller shares tasks out.

    cancelled: asked often; then Cancelled, without rows. A cell that cannot be measured (nothing to see, an image of
    nothing) is a row of NaN with the `reason`; the rest of a study goes on.
    """
    rows: list[Row] = []
    projects = [Project.from_text(cell.project).in_folder(Path(task.folder)) for cell in task.cells]

    def make() -> tuple[RenderedFrame, float]:
        before = time.process_time()
        frame = render(projects[0], image_scale=task.image_scale, threads=1, cancelled=cancelled)
        return frame, time.process_time() - before

    try:
        kept_by = (task.again, task.folder, task.image_scale)
        frame, rendering = rendered(kept_by, make) if task.again else make()
    except InputError as error:
        return [(cell.key, _nothing(str(error)), {}) for cell in task.cells]
    for cell, project in zip(task.cells, projects, strict=True):
        started = time.process_time()
        try:
            power = project.scene.lasers[task.laser].power
            image = develop(frame, laser=task.laser, sensor=project.sensor, power=power, threads=1)
            developed = time.process_time()
            if cell.assumed:
                image = as_if(image, Sensor.model_validate_json(cell.assumed))
            line = extract(image, settings=project.extraction, threads=1)
            extracted = time.process_time()
            made = _made_with(cell, project, task.laser)
            with_it = None if made is None else project.model_copy(update={"calibration": made.calibration})
            points = triangulate(line, project=with_it)
            errors, curve = compare(points, frame), frame.curves[task.laser]
            found: dict[str, Any] = dict(measures(line, points, errors, curve))
            found["facet_error"] = facet_error(frame.project.scene, curve)
            found |= _of_the_part(project, frame, line, points, errors)
            if cell.kept == ERRORS:
                found[KEPT_ROW] = on_the_line(points, errors, frame.seconds)
            elif cell.kept:
                found[KEPT_ROW] = profile(points, errors, curve) if cell.kept == "profile" else picture(image)
        except InputError as error:
            rows.append((cell.key, _nothing(str(error)), {"seconds_render": rendering, RAY_SPEED: rays_per_second()}))
            continue
        seconds = {
            "seconds_render": rendering,
            "seconds_develop": developed - started,
            "seconds_extract": extracted - developed,
            RAY_SPEED: rays_per_second(),
        }
        if made is not None:
            found |= made.measures
            seconds[CALIBRATING] = made.seconds
        rows.append((cell.key, {**found, "reason": ""}, seconds))
    return rows


def _of_the_part(
    project: Project, frame: RenderedFrame, line: ExtractedLine, points: TriangulatedPoints, errors: PointErrors
) -> dict[str, float]:
    """The project's measures of this laser's profile."""
    gauges = [
        one
        for one in project.measures
        if one.laser == points.laser and one.step in (None, frame.step) and not one.of_scan
    ]
    if not gauges or line.image is None:
        return {}
    found = Measurement(frame.step, points.laser, line.image, line, points, errors)
    both = profiles(frame.project, frame, found, frame.project.measured_in)
    return of_the_part([read(gauge, frame.step, *both) for gauge in gauges])


def _nothing(reason: str) -> dict[str, Any]:
    return {**{name: float("nan") for name in MEASURES}, "reason": reason}


def as_if(image: DevelopedImage, assumed: Sensor) -> DevelopedImage:
    """The image for line extraction that takes it to be of another sensor, at full image scale, with as many DN.

    Its weights, and with them what every other effect does, stay as they are where one effect is off.
    """
    sensor = scaled_sensor(assumed, image.frame.image_scale)
    gain = image.gain * image.project.sensor.full_well / sensor.full_well  # a full well is as many DN
    project = image.project.model_copy(update={"sensor": sensor})
    return replace(image, gain=gain, read_noise=sensor.read_noise, project=project)


def warm_up(project: Project, methods: Sequence[Method] = ()) -> None:
    """Compile or load the kernels that measuring takes, so that no cell's seconds hold them."""
    forget()
    rays_per_second()
    small = project.model_copy(update={"render": project.render.model_copy(update={"laser_error": 0.3})})
    frame = render(small, image_scale=0.05, threads=1)
    image = develop(frame, threads=1)
    for method in methods or (project.extraction.method,):
        settings = project.extraction.model_copy(update={"method": method})
        compare(triangulate(extract(image, settings=settings, threads=1)), frame)


def _made_with(cell: Work, project: Project, laser: int) -> Found | None:
    """What the cell's points are made with; None: the scene's own."""
    if not cell.boards:
        return None
    from studio.study.calibrating import calibrated  # loads statistics, a tenth of the window's start

    return calibrated(project, Boards.model_validate_json(cell.boards), laser)
