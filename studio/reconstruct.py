"""Points without rendering, from the frames of an earlier scan; and how an image file is read."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.report.model import FrameResult
from render.errors import InputError
from render.frame_files import read_frame
from render.material_checks import scene_warnings
from render.world import build_world
from studio import scan_folder
from studio.cautions import Cautions
from studio.project import Project
from studio.results import extraction_notes, measure_frame, now, write_points, write_reports
from studio.stages import Clock, develop_step, step_world
from studio.summary import summarise
from studio.sweep import Passing, Sweep, Taken

MAX_IMAGE_BYTES = 2**30


def reconstruct_folder(
    found: scan_folder.ScanFolder,
    project: Project,
    root: Path,
    out: Path,
    clock: Clock,
    *,
    report: bool,
    threads: int | None = None,
) -> dict[str, Any]:
    """Develop, extract and triangulate the frames of a scan anew; `project` may have another sensor or extraction.

    Writes points and, where asked for, the report into `out`. InputError: frames missing or not of this project.
    """
    results: list[FrameResult] = []
    image_scale = found.manifest.get("image_scale", 1.0)
    if not isinstance(image_scale, float | int) or not 0.0 < image_scale < math.inf:
        where = f"{found.folder / scan_folder.MANIFEST}: image_scale"
        raise InputError("the image scale is none", where=where, found=image_scale, allowed="a positive number")
    cautions = Cautions(project, image_scale)
    with clock.stage("loading meshes"), cautions.listening():
        first = world = build_world(project.scene, root, 0)
    sweep = Sweep(project)

    def take(ready: Iterable[tuple[Taken, Passing | None]]) -> None:
        keep = len(found.frames) <= 16
        for one, passing in ready:
            before = results[0] if results else None
            where = (one.frame, one.world, one.images)
            results.append(measure_frame(project, *where, clock, threads, keep=keep, passing=passing, first=before))

    for n in clock.frames(len(found.frames)):
        path = found.frames[n]
        with clock.stage("reading frames"):
            frame = read_frame(path)
        if not 0 <= frame.step < project.scene.frame_count:
            allowed = f"0 to {project.scene.frame_count - 1}"
            raise InputError(
                "the frame's step is not in the project", where=str(path), found=frame.step, allowed=allowed
            )
        world = step_world(project, root, frame.step, None if frame.step == 0 else world)
        cautions.look(frame, scene_warnings(world, project.scene, frame.step))
        images = develop_step(project, frame, clock, threads)
        take(sweep.add(frame, world, images))
    take(sweep.finish())
    if not results or not project.scene.lasers:
        raise InputError("the scan holds no laser image", where=str(found.folder))
    files, told = write_points(out, project, results, clock), extraction_notes(results, project)
    figures = summarise(results, project.scene)
    notes = cautions.notes(figures)
    if report:
        created = str(found.manifest.get("created", now()))
        files += write_reports(
            out,
            project,
            first,
            results,
            clock,
            notes=[*notes, *told],
            created=created,
            image_scale=image_scale,
        )
    return {
        "name": project.name,
        "files": [str(path) for path in files],
        "image_scale": image_scale,
        "results": figures,
        "notes": notes,
        "extraction": told,
        "seconds": clock.seconds,
    }


def read_image(path: Path) -> NDArray[Any]:
    """(h, w) or (h, w, 3) RGB digital numbers of a PNG, TIFF, JPEG or BMP. InputError: missing, too big or damaged."""
    import cv2

    try:
        size = path.stat().st_size
        if size > MAX_IMAGE_BYTES:
            raise InputError(
                "the image is too big", where=str(path), found=f"{size} bytes", allowed=f"{MAX_IMAGE_BYTES}"
            )
        data = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    except OSError as error:
        raise InputError("the image cannot be read", where=str(path), found=error.strerror or error) from None
    try:
        image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED) if len(data) else None
    except cv2.error as error:
        raise InputError("the image cannot be decoded", where=str(path), found=error.err) from None
    if image is None:
        raise InputError("the file is not an image", where=str(path), allowed="PNG, TIFF, JPEG or BMP")
    if image.ndim == 3:
        image = np.ascontiguousarray(image[:, :, 2::-1])
    return np.asarray(image)
