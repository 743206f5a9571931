"""What leaves the desktop as a file: report, frame, image, points. Qt-free; every file whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from analysis.cloud import Cloud, cloud, merge, write_csv, write_ply
from analysis.report.model import Extraction, FrameResult, LaserResult
from analysis.report.record import record_of
from render.develop import Image
from render.errors import InputError
from render.files import atomic_write
from render.frame import Frame
from render.frame_files import write_frame
from render.world import World, build_world
from studio.project import Project
from studio.results import now, report_input
from studio.stages import Measurement

Measurements = Mapping[str, Sequence[Measurement]]
"""By method: one for each laser."""


@dataclass(frozen=True)
class Exported:
    """A developed and measured render."""

    project: Project
    """As it was developed: with the sensor, extraction and powers that made the images."""
    rendered: Project
    """As it was rendered: what the radiance in the frame belongs to."""
    root: Path
    world: World
    frame: Frame
    images: tuple[Image, ...]
    measurements: Measurements


def export_report(path: Path, what: Exported) -> list[Path]:
    """One .html or .pdf file, by the suffix. InputError: nothing is measured, or the file cannot be written."""
    from analysis.report.write import render_page, write_report

    first = _first_world(what)
    with closing(record_of(what.project.scene, [frame_result(what)])) as record:
        data = report_input(what.project, first, record, {}, notes=(), created=now())
        if path.suffix.lower() != ".pdf":
            with atomic_write(path) as temporary:
                temporary.write_text(render_page(data), encoding="utf-8")
            return [path]
        with tempfile.TemporaryDirectory() as folder:
            _, pdf = write_report(folder, data)
            with atomic_write(path) as temporary:
                shutil.copyfile(pdf, temporary)
        return [path]


def export_frame(path: Path, what: Exported) -> list[Path]:
    """EXR with PNG and JSON beside it. InputError: a file cannot be written."""
    image = what.images[0] if len(what.images) == 1 else None
    return write_frame(path.parent, path.stem, what.frame, image, what.rendered.scene, sensor=what.project.sensor)


def export_image(path: Path, what: Exported) -> list[Path]:
    """Images in the sensor's digital numbers, 8 or 16 bit; of several lasers one file each, numbered."""
    import cv2

    if not what.images:
        raise InputError("there is no image yet", cure="render first")
    written = []
    for i, image in enumerate(what.images):
        target = path if len(what.images) == 1 else path.with_stem(f"{path.stem}_{i + 1}")
        done, encoded = cv2.imencode(".png", image.pixels)
        if not done:
            raise InputError("the image cannot be encoded", where=str(target))
        with atomic_write(target) as temporary:
            temporary.write_bytes(encoded.tobytes())
        written.append(target)
    return written


def export_points(path: Path, what: Exported) -> list[Path]:
    """.ply or .csv, by the suffix: the points of all lasers by the project's method."""
    write = write_csv if path.suffix.lower() == ".csv" else write_ply
    write(path, merge(point_clouds(what)))
    return [path]


def point_clouds(what: Exported) -> list[Cloud]:
    """One for each laser, by the project's method."""
    found = _best(what)
    return [cloud(one.points, one.errors, one.laser, one.step, what.project.scene) for one in found]


def frame_result(what: Exported) -> FrameResult:
    """As a report takes it, the project's own method first. InputError: nothing is measured."""
    _best(what)
    own = what.project.extraction.method
    order = [own, *(method for method in what.measurements if method != own)]
    lasers = []
    for i, curve in enumerate(what.frame.curves):
        found = [what.measurements[method][i] for method in order if method in what.measurements]
        extractions = tuple(Extraction(one.line, one.points, one.errors) for one in found)
        lasers.append(LaserResult(curve, extractions, what.images[i].pixels if i < len(what.images) else None))
    frame = what.frame
    return FrameResult(frame.step, tuple(lasers), plan=frame.plan, seconds=frame.seconds, counts=frame.counts)


def _best(what: Exported) -> Sequence[Measurement]:
    if not what.measurements:
        raise InputError("nothing is measured yet", cure="render first, and wait for the measurement")
    own = what.project.extraction.method
    return what.measurements.get(own) or next(iter(what.measurements.values()))


def _first_world(what: Exported) -> World:
    """The world of step 0, which a report moves itself."""
    return what.world if what.frame.step == 0 else build_world(what.project.scene, what.root, 0)
