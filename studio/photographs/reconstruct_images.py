"""Points from photographs of a real scanner: the project gives camera, laser, motion and extraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.cloud import cloud, merge, write_csv, write_ply
from analysis.line.result import Flag, Line
from analysis.line.series import spacetime_moving
from render.base.errors import InputError
from studio.photographs.image_files import load_photograph
from studio.photographs.photograph_report import PhotographReport, write_photograph_report
from studio.photographs.photograph_set import Wishes, look_at
from studio.photographs.photographs import Measured, check_size, extract_photograph, extract_series, naming
from studio.project.project import Project
from studio.scan.line_extraction import extraction_of, working_volume
from studio.scan.own_files import check_replaceable
from studio.scan.spacetime_window import surface_motion
from studio.scan.stages import Clock, triangulate_line


def reconstruct_images(
    paths: Sequence[Path],
    project: Project,
    laser: int,
    out: Path,
    clock: Clock,
    times: Sequence[float] = (),
    threads: int | None = None,
    wishes: Wishes | None = None,
) -> dict[str, Any]:
    """Points of one laser in photographs; noise is estimated from them, and there is no truth to compare with.

    wishes: what the photographs are not to say themselves; None: the project's axis and colour. times: the images are
    exposures of one scene, so long; else they are the steps of the project's motion, in order. InputError: an image
    cannot be read or is not of the camera's size, no such laser, more images than steps, a file in the way that is none
    of these results.
    """
    lasers = project.scene.lasers
    if not 0 <= laser < len(lasers):
        raise InputError("there is no such laser in the project", found=laser, allowed=f"0 to {len(lasers) - 1}")
    if not times and len(paths) > project.scene.frame_count:
        found, allowed = f"{len(paths)} images", f"{project.scene.frame_count}, the steps of the project's motion"
        raise InputError("there are more images than steps", where=str(paths[-1]), found=found, allowed=allowed)
    stem = paths[0].stem
    files = [out / name for name in (f"{stem}.ply", f"{stem}.csv", f"{stem}_report.html", f"{stem}_report.pdf")]
    check_replaceable(files, paths)
    volume = working_volume(project, laser)
    for path in paths:
        with naming(path):
            check_size(load_photograph(path), project.scene.camera)
    with clock.stage("line extraction"):
        settings = extraction_of(project)
        if wishes is None:
            wishes = Wishes(settings.axis, None if settings.channel == "auto" else settings.channel)
        look = look_at(paths, settings, wishes)
        if times:
            line = extract_series(paths, times, look, volume=volume, threads=threads)
            measured = [Measured(line, look.read(paths[0])[0].pixels)]
        else:
            measured = [extract_photograph(path, look, threads, volume) for path in paths]
        lines = [one.line for one in measured]
        if look.settings.spacetime:
            lines = _along_time(measured, project, laser, threads)
    with clock.stage("triangulation"):
        points = [triangulate_line(project, line, laser, step) for step, line in enumerate(lines)]
    with clock.stage("writing points"):
        columns = merge([cloud(one, None, laser, step, project.scene) for step, one in enumerate(points)])
        write_ply(files[0], columns)
        write_csv(files[1], columns)
    with clock.stage("report"):
        shown = [replace(one, line=line) for one, line in zip(measured, lines, strict=True)]
        names = [path.name for path in paths[: len(shown)]]
        report = PhotographReport(project, laser, look, names, shown, points, wishes.shape)
        fits = write_photograph_report(files[2], files[3], report)
    flags, counts = np.unique(np.concatenate([line.flag[:, 0] for line in lines]), return_counts=True)
    return {
        "name": project.name,
        "files": [str(file) for file in files],
        "points": sum(int(one.valid.sum()) for one in points),
        "scan_lines": sum(len(line.u) for line in lines),
        "chosen": look.record(),
        "fits": fits,
        "extraction": list(dict.fromkeys(line.note for line in lines if line.note)),
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "seconds": clock.seconds,
    }


def _along_time(measured: Sequence[Measured], project: Project, laser: int, threads: int | None) -> list[Line]:
    """The lines measured along time, in place of each image alone."""
    if len(measured) < 2 * spacetime_moving.FEWEST + 1:
        raise InputError(
            "a passage along time needs more images",
            where="extraction.spacetime",
            found=len(measured),
            allowed=f"{2 * spacetime_moving.FEWEST + 1} or more",
        )
    plane, found = project.scene.laser_plane(laser), []
    images = [np.zeros(one.image.shape[:2], np.float32) if one.light is None else one.light for one in measured]
    for at, one in enumerate(measured):
        assert one.noise is not None
        first, last = max(0, at - spacetime_moving.MOST), min(len(images), at + spacetime_moving.MOST + 1)
        moves = np.stack([surface_motion(project.scene, at, step) for step in range(first, last)])
        camera = project.scene.camera
        sweep = spacetime_moving.Sweep(images[first:last], at - first, moves, plane, camera, one.noise)
        timed = spacetime_moving.along_time(one.line, sweep, threads)
        found.append(replace(timed, note="; ".join(filter(None, (one.line.note, "measured along time")))))
    return found
