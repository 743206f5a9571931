"""From frames to results: every laser measured by every method, and what a report is made of."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import metadata

from analysis.line.settings import Method
from analysis.report.calibration import FoundCalibration, MotionFound
from analysis.report.frame_result import Extraction, FrameResult, LaserResult
from analysis.report.model import ReportInput
from analysis.report.record import ScanRecord
from render.base.model import Model
from render.frame import Frame
from render.sensor.develop import Image
from render.world.world import World
from studio.project.found_motion import true_motion, values_of
from studio.project.project import Project
from studio.scan.gauging import measures_record, patches, readings
from studio.scan.logo import logo_uri
from studio.scan.sheet_lean import section_note
from studio.scan.spacetime_window import Passing
from studio.scan.stages import Clock, Measurement, measure_step

METHODS: tuple[Method, ...] = ("likelihood", "gaussian", "centre_of_mass")
LIBRARIES = ("blazer-studio", "embreex", "numba", "numpy", "opencv-contrib-python-headless", "open3d", "OpenEXR")


def measure_frame(  # noqa: PLR0913
    project: Project,
    frame: Frame,
    world: World,
    images: list[Image],
    clock: Clock,
    threads: int | None,
    *,
    keep: bool,
    passing: Passing | None = None,
    compared: tuple[Method, ...] | None = None,
) -> FrameResult:
    """One frame by the project's method and, to compare with, by the others. `keep` the images for the report.

    passing: the frames around it, for the project's method alone. compared: the other methods, which are those of the
    scan's first frame in all its frames, where "auto" may pick another in each; None: this is the first.
    """
    before = dict(clock.seconds)
    own = measure_step(project, frame, world, images, clock, threads, passing=passing)
    by_method: list[list[Measurement]] = [own]
    with clock.stage("other methods, to compare with"):
        aside = Clock(lambda stage, done: None, clock.cancelled)
        for method in _others(own) if compared is None else compared:
            by_method.append(measure_step(project, frame, world, images, aside, threads, method))
    lasers = []
    for i, image in enumerate(images):
        extractions = tuple(Extraction(found[i].line, found[i].points, found[i].errors) for found in by_method)
        lasers.append(LaserResult(frame.curves[i], extractions, image.grey if keep else None))
    spent = {name: seconds - before.get(name, 0.0) for name, seconds in clock.seconds.items()}
    seconds = {**frame.seconds, **{name: value for name, value in spent.items() if value > 0.0}}
    return FrameResult(
        frame.step,
        tuple(lasers),
        plan=frame.plan,
        quality=frame.quality,
        seconds=seconds,
        readings=readings(project, frame, own),
        patches=patches(project, frame, own),
        counts=frame.counts,
    )


def _others(own: list[Measurement]) -> tuple[Method, ...]:
    """Those to compare with; never what "auto" picked for the first laser."""
    return tuple(method for method in METHODS if not own or method != own[0].line.method)


def compared_methods(frame: FrameResult) -> tuple[Method, ...]:
    """Those that the project's own was compared with."""
    methods = {extraction.line.method: None for laser in frame.lasers for extraction in laser.extractions[1:]}
    return tuple(method for method in METHODS if method in methods)


def report_input(
    project: Project,
    world: World,
    record: ScanRecord,
    seconds: Mapping[str, float],
    *,
    notes: Sequence[str],
    created: str,
    image_scale: float = 1.0,
    run: str = "",
) -> ReportInput:
    """What a report is made of; `world` is that of step 0, `seconds` the wall time by stage, `run` as of `run_text`.

    The logo is looked for in the project's folder; one that cannot be shown is left out.
    """
    logo, _ = logo_uri(project.delivery.logo, project.folder)
    return ReportInput(
        title=project.name,
        scene=project.scene,
        record=record,
        vertices=world.vertices,
        triangles=world.triangles,
        object_id=world.object_id,
        sensor=project.sensor,
        display_max=float(2**project.sensor.bits - 1),
        settings={"Line extraction": settings_table(project.extraction), "Rendering": settings_table(project.render)},
        seconds={name: value for name, value in seconds.items() if name not in record.seconds},
        seed=project.seed,
        versions=versions(),
        notes=tuple(notes),
        created=created,
        image_scale=image_scale,
        measures=tuple(measures_record(project.measures, record.readings)),
        measures_note=section_note(project),
        delivery=project.delivery,
        logo=logo,
        calibration=_found(project),
        run=run,
    )


def _found(project: Project) -> FoundCalibration | None:
    """The project's calibration as a report has it; None where points are made as the scene has it, exactly."""
    given, scene = project.calibration, project.scene
    if given.camera is None and given.laser_count == 0 and given.motion is None:
        return None
    lasers = range(len(scene.lasers))
    moved, true = given.motion, true_motion(scene, (0,))
    motion = None
    if moved is not None and true is not None:
        motion = MotionFound(moved.kind, moved.values, moved.sigma, values_of(true))
    return FoundCalibration(
        given.camera_of(scene.camera),
        tuple(given.plane(i, scene.laser_plane(i)) for i in lasers),
        tuple(given.covariance(i) for i in lasers),
        motion,
    )


def settings_table(settings: Model) -> dict[str, str]:
    """Label -> value with its unit, as the fields of a model describe themselves."""
    rows = {}
    for name, info in type(settings).model_fields.items():
        extra = info.json_schema_extra
        unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
        value = getattr(settings, name)
        if isinstance(value, bool):
            value = "yes" if value else "no"
        rows[info.title or name] = "automatic" if value is None else f"{value} {unit}".strip()
    return rows


def versions() -> dict[str, str]:
    """Python and the libraries that decide the numbers."""
    found = {"Python": platform.python_version()}
    for name in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found
