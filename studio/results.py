"""From frames to results: every laser measured by every method, point files, the report."""

from __future__ import annotations

import datetime
import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from analysis.cloud import Cloud, cloud, merge, write_csv, write_ply
from analysis.line.settings import Method
from analysis.report.model import Extraction, FrameResult, LaserResult, ReportInput
from render.develop import Image
from render.frame import Frame
from render.model import Model
from render.world import World
from studio.project import Project
from studio.stages import Clock, Measurement, measure_step

METHODS: tuple[Method, ...] = ("likelihood", "gaussian", "centre_of_mass")
LIBRARIES = ("blazer-studio", "embreex", "numba", "numpy", "opencv-contrib-python-headless", "open3d", "OpenEXR")


def measure_frame(
    project: Project, frame: Frame, world: World, images: list[Image], clock: Clock, threads: int | None, *, keep: bool
) -> FrameResult:
    """One frame by the project's method and, to compare with, by the others. `keep` the images for the report."""
    chosen = project.extraction.method
    before = dict(clock.seconds)
    by_method: list[list[Measurement]] = [measure_step(project, frame, world, images, clock, threads)]
    with clock.stage("other methods, to compare with"):
        aside = Clock(lambda stage, done: None, clock.cancelled)
        for method in METHODS:
            if method != chosen:
                by_method.append(measure_step(project, frame, world, images, aside, threads, method))
    lasers = []
    for i, image in enumerate(images):
        extractions = tuple(Extraction(found[i].line, found[i].points, found[i].errors) for found in by_method)
        lasers.append(LaserResult(frame.curves[i], extractions, image.pixels if keep else None))
    spent = {name: seconds - before.get(name, 0.0) for name, seconds in clock.seconds.items()}
    seconds = {**frame.seconds, **{name: value for name, value in spent.items() if value > 0.0}}
    return FrameResult(frame.step, tuple(lasers), plan=frame.plan, seconds=seconds, counts=frame.counts)


def write_points(out: Path, project: Project, results: list[FrameResult], clock: Clock) -> list[Path]:
    """points.ply and points.csv of all frames and lasers, by the project's method, at the first step's pose."""
    with clock.stage("writing points"):
        clouds: list[Cloud] = []
        for frame in results:
            for i, laser in enumerate(frame.lasers):
                best = laser.extractions[0]
                clouds.append(cloud(best.points, best.errors, i, frame.step, project.scene))
        columns = merge(clouds)
        write_ply(out / "points.ply", columns)
        write_csv(out / "points.csv", columns)
    return [out / "points.ply", out / "points.csv"]


def write_reports(
    out: Path,
    project: Project,
    world: World,
    results: Sequence[FrameResult],
    clock: Clock,
    *,
    notes: Sequence[str],
    created: str,
) -> list[Path]:
    """report.html and report.pdf; `world` is that of step 0."""
    from analysis.report.write import write_report

    data = report_input(project, world, results, clock.seconds, notes=notes, created=created)
    with clock.stage("report"):
        return list(write_report(out, data))


def report_input(
    project: Project,
    world: World,
    results: Sequence[FrameResult],
    seconds: Mapping[str, float],
    *,
    notes: Sequence[str],
    created: str,
) -> ReportInput:
    """What a report is made of; `world` is that of step 0, `seconds` the wall time by stage."""
    return ReportInput(
        title=project.name,
        scene=project.scene,
        frames=tuple(results),
        vertices=world.vertices,
        triangles=world.triangles,
        object_id=world.object_id,
        sensor=project.sensor,
        display_max=float(2**project.sensor.bits - 1),
        settings={"Line extraction": settings_table(project.extraction), "Rendering": settings_table(project.render)},
        seconds={name: value for name, value in seconds.items() if name not in _frame_stages(results)},
        seed=project.seed,
        versions=versions(),
        notes=tuple(notes),
        created=created,
    )


def settings_table(settings: Model) -> dict[str, str]:
    """Label -> value with its unit, as the fields of a model describe themselves."""
    rows = {}
    for name, info in type(settings).model_fields.items():
        extra = info.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        value = getattr(settings, name)
        rows[info.title or name] = "automatic" if value is None else f"{value} {unit}".strip()
    return rows


def versions() -> dict[str, str]:
    """Python and the libraries that decide the numbers."""
    found = {"Python": platform.python_version()}
    for name in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def now() -> str:
    """Date and time with its zone, to the second."""
    return datetime.datetime.now().astimezone().isoformat(sep=" ", timespec="seconds")


def _frame_stages(results: Sequence[FrameResult]) -> set[str]:
    return {name for frame in results for name in frame.seconds}
