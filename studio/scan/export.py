"""What leaves the desktop as a file: report, frame, image, points. Qt-free; every file whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from analysis.cloud import Cloud, cloud, merge, write_csv, write_ply
from analysis.cloud_formats import WRITERS, write_points
from analysis.report.record import ScanRecord, record_of
from render.base.errors import Cancelled, InputError
from render.base.files import atomic_write
from render.base.threads import Cancel
from render.frame import Frame
from render.output.frame_files import write_frame
from render.sensor.develop import Image
from render.world.world import World, build_world
from studio.project.date_and_time import now
from studio.project.input_files import input_files, input_hashes
from studio.project.project import Project
from studio.scan.cautions import Cautions
from studio.scan.image_lacks import image_lacks
from studio.scan.own_files import check_not_read, check_replaceable
from studio.scan.remarks import Measurements, best, frame_result
from studio.scan.results import report_input
from studio.scan.run_record import run_text
from studio.scan.summary import summarise


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
    image_scale: float = 1.0
    """Of the image, to the scanner's."""
    repeatable: bool = False
    """A run of the project's first step, as it is now, gives the same images."""
    finished: bool = True
    """The frame's light was neither stopped nor ended by the clock."""
    part_of: str = ""
    """What a report says of the whole that this is a part of."""


Writer = Callable[[Path, Exported], list[Path]]
"""Any of those below: makes the file, and what belongs beside it; gives the paths."""


def export_report(path: Path, what: Exported) -> list[Path]:
    """One .html or .pdf file, by the suffix. InputError: nothing is measured, or the file cannot be written."""
    from analysis.report.write import render_page, write_report

    _spare_inputs(what, [path])
    first = _first_world(what)
    rig = what.rendered.scene.rig.model_copy(update={"camera": what.project.scene.camera})  # its lens is that of now
    scene = what.rendered.scene.model_copy(update={"rig": rig})
    cautions = Cautions(
        what.rendered.model_copy(update={"sensor": what.project.sensor, "scene": scene}),
        what.image_scale,
        [laser.power for laser in what.project.scene.lasers],
    )
    cautions.look(what.frame, what.frame.warnings, what.images)
    result = frame_result(what.project, what.frame, what.measurements, what.images)
    with closing(record_of(what.project.scene, [result])) as record:
        lacks = image_lacks(what.project, best(what.measurements, what.project))
        notes = [*filter(None, [what.part_of]), *cautions.notes(summarise(record)), *lacks.values()]
        data = report_input(
            what.project.in_folder(what.root),
            first,
            record,
            {},
            notes=notes,
            created=now(),
            image_scale=what.image_scale,
            run=_run_text(what, record),
        )
        data = replace(data, part_of=what.part_of)
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
    """EXR with PNG and JSON beside it. InputError: a file cannot be written, or one beside it is no frame's."""
    _spare_inputs(what, [path])
    beside = [path.with_suffix(suffix) for suffix in (".exr", ".png", ".json")]
    check_replaceable([file for file in beside if file != path], input_files(what.project.scene, what.root).values())
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
        _spare_inputs(what, [target])
        numbers = image.pixels if image.pixels.ndim == 2 else image.pixels[..., ::-1]
        done, encoded = cv2.imencode(".png", numbers)
        if not done:
            raise InputError("the image cannot be encoded", where=str(target))
        with atomic_write(target) as temporary:
            temporary.write_bytes(encoded.tobytes())
        written.append(target)
    return written


def export_points(path: Path, what: Exported) -> list[Path]:
    """.ply, .csv or one of `cloud_formats`, by the suffix: the points of all lasers by the project's method."""
    _spare_inputs(what, [path])
    points, suffix = merge(point_clouds(what)), path.suffix.lower()
    if suffix in WRITERS:
        write_points(path, points)
    else:
        (write_csv if suffix == ".csv" else write_ply)(path, points)
    return [path]


def export_unless(cancelled: Cancel, write: Writer, path: Path, what: Exported) -> list[Path]:
    """What a writer makes, once all of it is made; a cancelled export leaves no file. Raises Cancelled."""
    with tempfile.TemporaryDirectory() as folder:
        made = write(Path(folder) / path.name, what)
        if cancelled():
            raise Cancelled
        for file in made:
            with atomic_write(path.with_name(file.name)) as temporary:
                shutil.copyfile(file, temporary)
    return [path.with_name(file.name) for file in made]


def point_clouds(what: Exported) -> list[Cloud]:
    """One for each laser, by the project's method."""
    found = best(what.measurements, what.project)
    return [cloud(one.points, one.errors, one.laser, one.step, what.project.scene) for one in found]


def _run_text(what: Exported, record: ScanRecord) -> str:
    """As of `run_text`; empty: another power than the rendered one scales the light, which a run only does nearly."""
    rendered, now = (tuple(laser.power for laser in one.scene.lasers) for one in (what.rendered, what.project))
    if not what.repeatable or rendered != now:
        return ""
    inputs = input_hashes(what.project.scene, what.root)
    return run_text(what.project, record, image_scale=what.image_scale, inputs=inputs, finished=what.finished)


def _spare_inputs(what: Exported, targets: Sequence[Path]) -> None:
    """InputError: a target is a mesh or a texture of the project."""
    check_not_read(targets, input_files(what.project.scene, what.root).values())


def _first_world(what: Exported) -> World:
    """The world of step 0, which a report moves itself."""
    return what.world if what.frame.step == 0 else build_world(what.project.scene, what.root, 0)
