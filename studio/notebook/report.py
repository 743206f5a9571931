"""`write_report`: one frame and what was measured of it, as a page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from analysis.error import Errors
from analysis.line.result import Line
from analysis.triangulate import Points
from render.base.errors import InputError
from render.sensor.develop import Image
from studio.notebook.checks import as_sequence, expect, plain
from studio.notebook.frame import RENDER, RenderedFrame
from studio.notebook.measuring import (
    DEVELOP,
    EXTRACT,
    TRIANGULATE,
    DevelopedImage,
    ExtractedLine,
    PointErrors,
    TriangulatedPoints,
)
from studio.project.project import Project
from studio.scan.export import Exported, export_report
from studio.scan.stages import Measurement

SUFFIXES = (".html", ".pdf")


def write_report(
    path: Path | str,
    frame: RenderedFrame,
    image: DevelopedImage | Sequence[DevelopedImage],
    line: ExtractedLine | Sequence[ExtractedLine],
    points: TriangulatedPoints | Sequence[TriangulatedPoints],
    errors: PointErrors | Sequence[PointErrors],
) -> Path:
    """One self-contained page, .html or .pdf by the suffix; returns its path.

    Of a rig with several lasers image, line, points and errors are lists, one entry for each, in their order.

    InputError: another suffix, results that are not of one another or not of all lasers, a place that cannot be
    written, or a file that the project reads. Nothing is left half-written.

    >>> import studio as blazer
    >>> frame = blazer.render(blazer.Project.load("plane"), image_scale=0.1)
    >>> image = blazer.develop(frame)
    >>> line = blazer.extract(image)
    >>> points = blazer.triangulate(line)
    >>> errors = blazer.compare(points, frame)
    >>> blazer.write_report("report.html", frame, image, line, points, errors).name
    'report.html'
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(
            "a report is not of that kind", where=str(target), found=target.suffix or "no suffix", allowed=".html, .pdf"
        )
    expect(frame, RenderedFrame, "write_report: frame", RENDER)
    images = [expect(one, DevelopedImage, "write_report: image", DEVELOP) for one in as_sequence(image)]
    lines = [expect(one, ExtractedLine, "write_report: line", EXTRACT) for one in as_sequence(line)]
    clouds = [expect(one, TriangulatedPoints, "write_report: points", TRIANGULATE) for one in as_sequence(points)]
    compared = [
        expect(one, PointErrors, "write_report: errors", "compare: errors = blazer.compare(points, frame)")
        for one in as_sequence(errors)
    ]
    wanted = len(frame.project.scene.lasers)
    for name, found in (("image", images), ("line", lines), ("points", clouds), ("errors", compared)):
        if len(found) != wanted:
            raise InputError(
                "the report is of all lasers, in their order",
                where=f"write_report: {name}",
                found=len(found),
                allowed=str(wanted),
                cure="give lists, with one entry for each laser",
            )
    measured = []
    for i in range(wanted):
        _check_belong(i, frame, images[i], lines[i], clouds[i], compared[i])
        bare = plain(Image, images[i]), plain(Line, lines[i]), plain(Points, clouds[i]), plain(Errors, compared[i])
        measured.append(Measurement(frame.step, i, *bare))
    exported = Exported(
        project=_developed(frame.project, images, lines),
        rendered=frame.project,
        root=frame.project.folder,
        world=frame.world,
        frame=frame,
        images=tuple(images),
        measurements={lines[0].settings.method: measured},
        image_scale=frame.image_scale,
    )
    return export_report(target, exported)[0]


def _check_belong(
    laser: int,
    frame: RenderedFrame,
    image: DevelopedImage,
    line: ExtractedLine,
    points: TriangulatedPoints,
    errors: PointErrors,
) -> None:
    """InputError: one is not made of the one before it."""
    chain = (
        ("image", image.frame is frame and image.laser == laser, f"the image of laser {laser} of this frame"),
        ("line", line.image is image, "the line extracted from this image"),
        ("points", points.line is line and points.laser == laser, "the points triangulated from this line"),
        ("errors", errors.points is points, "the errors of these points"),
    )
    for name, belongs, allowed in chain:
        if not belongs:
            raise InputError(
                "this is not made of what stands before it",
                where=f"write_report: {name}",
                allowed=allowed,
                cure="run the steps in their order, and keep what each gives",
            )


def _developed(project: Project, images: Sequence[DevelopedImage], lines: Sequence[ExtractedLine]) -> Project:
    """As the images were made, each laser with the power that its own had, and the first line's settings."""
    lasers = tuple(image.project.scene.lasers[image.laser] for image in images)
    rig = project.scene.rig.model_copy(update={"lasers": lasers})
    return images[0].project.model_copy(
        update={"scene": project.scene.model_copy(update={"rig": rig}), "extraction": lines[0].settings}
    )
