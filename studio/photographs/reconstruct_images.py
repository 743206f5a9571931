"""Points from photographs of a real scanner: the project gives camera, laser, motion and extraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import cloud, merge, write_csv, write_ply
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.series import spacetime_moving
from render.base.errors import InputError
from studio.photographs.image_files import load_photograph
from studio.photographs.photographs import extract_series, naming
from studio.project.project import Project
from studio.scan.line_extraction import note_of, working_volume
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
) -> dict[str, Any]:
    """Points of one laser in photographs; noise is estimated from them, and there is no truth to compare with.

    times: the images are exposures of one scene, so long; else they are the steps of the project's motion, in order.
    InputError: an image cannot be read or is not of the camera's size, no such laser, more images than steps,
    a file in the way that is none of these results.
    """
    lasers = project.scene.lasers
    if not 0 <= laser < len(lasers):
        raise InputError("there is no such laser in the project", found=laser, allowed=f"0 to {len(lasers) - 1}")
    if not times and len(paths) > project.scene.frame_count:
        found, allowed = f"{len(paths)} images", f"{project.scene.frame_count}, the steps of the project's motion"
        raise InputError("there are more images than steps", where=str(paths[-1]), found=found, allowed=allowed)
    files = [out / f"{paths[0].stem}.ply", out / f"{paths[0].stem}.csv"]
    check_replaceable(files, paths)
    with clock.stage("line extraction"):
        if times:
            _sized(paths[0], project)
            volume = working_volume(project, laser)
            lines = [extract_series(paths, times, project.extraction, volume=volume, threads=threads)]
        else:
            lines = _lines(paths, project, laser, threads)
    with clock.stage("triangulation"):
        points = [triangulate_line(project, line, laser, step) for step, line in enumerate(lines)]
    with clock.stage("writing points"):
        columns = merge([cloud(one, None, laser, step, project.scene) for step, one in enumerate(points)])
        write_ply(files[0], columns)
        write_csv(files[1], columns)
    flags, counts = np.unique(np.concatenate([line.flag[:, 0] for line in lines]), return_counts=True)
    return {
        "name": project.name,
        "files": [str(file) for file in files],
        "points": sum(int(one.valid.sum()) for one in points),
        "scan_lines": sum(len(line.u) for line in lines),
        "extraction": list(dict.fromkeys(line.note for line in lines if line.note)),
        "flags": {Flag(int(flag)).name: int(count) for flag, count in zip(flags, counts, strict=True)},
        "seconds": clock.seconds,
    }


def _sized(path: Path, project: Project) -> NDArray[Any]:
    """The image of a file. InputError: not of the camera's size."""
    camera, image = project.scene.camera, load_photograph(path)
    if image.shape[:2] != (camera.height, camera.width):
        raise InputError(
            "the image is not of the camera's size",
            where=str(path),
            found=f"{image.shape[1]} x {image.shape[0]} px",
            allowed=f"{camera.width} x {camera.height} px",
        )
    return image


def _lines(paths: Sequence[Path], project: Project, laser: int, threads: int | None) -> list[Line]:
    """One line an image; measured along time where the project says so."""
    settings, volume = project.extraction, working_volume(project, laser)
    images, lines = [_sized(path, project) for path in paths], []
    noises = []
    for path, image in zip(paths, images, strict=True):
        with naming(path):
            noises.append(estimate_noise(image, settings))
            line = extract(image, settings=settings, noise=noises[-1], volume=volume, threads=threads)
            lines.append(replace(line, note=note_of(line, settings, [])))
    if not settings.spacetime:
        return lines
    if len(images) < 2 * spacetime_moving.FEWEST + 1:
        raise InputError(
            "a passage along time needs more images",
            where="extraction.spacetime",
            found=len(images),
            allowed=f"{2 * spacetime_moving.FEWEST + 1} or more",
        )
    plane, found = project.scene.laser_plane(laser), []
    for at, line in enumerate(lines):
        first, last = max(0, at - spacetime_moving.MOST), min(len(images), at + spacetime_moving.MOST + 1)
        moves = np.stack([surface_motion(project.scene, at, step) for step in range(first, last)])
        camera = project.scene.camera
        sweep = spacetime_moving.Sweep(images[first:last], at - first, moves, plane, camera, noises[at])
        timed = spacetime_moving.along_time(line, sweep, threads)
        found.append(replace(timed, note="; ".join(filter(None, (line.note, "measured along time")))))
    return found
