"""What a reader should notice about a measured render: at which scale it was, and what its numbers say. Qt-free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing

from analysis.report.frame_result import Extraction, FrameResult, LaserResult
from analysis.report.record import ScanRecord, record_of
from analysis.report.summary import remarks, scale_head, scale_note
from analysis.report.total import total
from render.base.errors import InputError
from render.frame import Frame
from render.sensor.develop import Image
from studio.project.project import Project
from studio.runtime.place_words import in_words
from studio.scan.gauging import patches, readings
from studio.scan.image_lacks import image_lacks
from studio.scan.stages import Measurement

__all__ = ["best", "frame_remarks", "frame_result", "result_remarks", "scale_head", "scale_name", "scale_notes"]

OF_ALL_LASERS = "What follows is of all lasers together; charts and table are of the one that is chosen."
Measurements = Mapping[str, Sequence[Measurement]]
"""By method: one for each laser."""


def scale_name(image_scale: float) -> str:
    """ "image scale 0.25"; empty at the scanner's own."""
    return "" if image_scale == 1.0 else f"image scale {image_scale:.3g}"


def scale_notes(image_scale: float) -> tuple[str, ...]:
    """What to say of figures that were measured at another image scale than the scanner's; nothing at its own."""
    return tuple(filter(None, [scale_note(image_scale)]))


def frame_remarks(project: Project, frame: Frame, measurements: Measurements, doubts: Sequence[str] = ()) -> list[str]:
    """What was odd about a frame, and what its errors say beyond themselves; nothing where all is as it should be.

    doubts: of `studio.preview.inspection.view_warnings`, in a frame that is developed as `project` says.
    """
    unread = project.model_copy(update={"measures": ()})  # no remark is on the part's measures
    with closing(record_of(project.scene, [frame_result(unread, frame, measurements)])) as record:
        lacks = image_lacks(project, best(measurements, project))
        said = [*lacks.values(), *result_remarks(record)]  # what the sensor leaves out is more than all others
        of_all = [OF_ALL_LASERS] if said and len(project.scene.lasers) > 1 else []
        return [*doubts, *map(in_words, frame.warnings), *of_all, *said]


def result_remarks(record: ScanRecord) -> list[str]:
    """The report's remarks on the errors of one frame or of a whole scan."""
    return remarks(total(record.chosen()))


def frame_result(
    project: Project, frame: Frame, measurements: Measurements, images: Sequence[Image] = ()
) -> FrameResult:
    """As a report takes it, the project's own method first. InputError: nothing is measured."""
    best(measurements, project)
    own = project.extraction.method
    order = [own, *(method for method in measurements if method != own)]
    lasers = []
    for i, curve in enumerate(frame.curves):
        found = [measurements[method][i] for method in order if method in measurements]
        extractions = tuple(Extraction(one.line, one.points, one.errors) for one in found)
        lasers.append(LaserResult(curve, extractions, images[i].grey if i < len(images) else None))
    return FrameResult(
        frame.step,
        tuple(lasers),
        plan=frame.plan,
        quality=frame.quality,
        seconds=frame.seconds,
        readings=readings(project, frame, best(measurements, project)),
        patches=patches(project, frame, best(measurements, project)),
        counts=frame.counts,
    )


def best(measurements: Measurements, project: Project) -> Sequence[Measurement]:
    """By the project's own method, else by the first. InputError: nothing is measured."""
    if not measurements:
        raise InputError("nothing is measured yet", cure="render first, and wait for the measurement")
    return measurements.get(project.extraction.method) or next(iter(measurements.values()))
