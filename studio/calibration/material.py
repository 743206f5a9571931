"""What a calibration is made from: views of photographs or virtual ones, and what was wrong with the others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.calibration.board import Board
from analysis.calibration.detect import FEWEST
from analysis.calibration.estimate import Estimate
from analysis.calibration.motion import Told
from analysis.calibration.next_pose import Advice
from analysis.calibration.observations import View
from analysis.calibration.virtual import exact_view, noisy
from analysis.line.settings import ExtractionSettings
from render.base.errors import InputError
from studio.calibration.carried import carried_views
from studio.calibration.drawings import advised_pose
from studio.calibration.image_views import Shot, shots, views_of
from studio.calibration.in_silico import virtual_views
from studio.project.project import Project

VIEWS, SEED, SIGMA, MOST_TILT = 20, 0, 0.05, float(np.radians(45.0))
"""Of virtual boards: how many, of which draw, px of corners and lines, rad."""
LEAST_SPAN, NOWHERE = 0.1, 0.2
"""Of the middle of the depths: how far virtual boards reach to either side of it at least, and where no line is."""
LASER_STEP = 8
"""Rows from a virtual line's point to the next."""


@dataclass(frozen=True)
class Material:
    """Views with what was told of them."""

    views: tuple[View, ...]
    size: tuple[int, int]
    """px, width and height."""
    lasers: int
    """That are to be calibrated."""
    errors: tuple[str, ...] = ()
    """Of files that are not used, each with its path."""
    notes: tuple[str, ...] = ()
    """Of views, each with its name."""
    told: Told | None = None
    """Of a motion that carried the board."""
    names: tuple[str, ...] = ()
    """Of the lasers, where they are those of a project."""

    def without(self, names: Collection[str]) -> Material:
        """The same without some views."""
        return replace(self, views=tuple(view for view in self.views if view.name not in names))

    def without_lasers(self) -> Material:
        """The same for the camera alone."""
        return replace(self, views=tuple(replace(view, stripes=()) for view in self.views), lasers=0)

    def joined(self, more: Material) -> Material:
        """Both together; what is there already is told. InputError: images of another size."""
        if more.size != self.size:
            raise InputError(
                "the photographs are of another size than those before",
                found="{} x {} px".format(*more.size),
                allowed="{} x {} px".format(*self.size),
                cure="do not crop, turn or resize photographs",
            )
        new, errors = [], []
        for view in more.views:
            if any(view.name == other.name for other in self.views):
                errors.append(f"{view.name}: a view of that name is there already")
            elif any(np.array_equal(view.pixel, other.pixel) for other in self.views):
                errors.append(f"{view.name}: a photograph that is there already; every pose counts once")
            else:
                new.append(view)
        notes = (*self.notes, *more.notes)
        errors = [*self.errors, *more.errors, *errors]
        return Material((*self.views, *new), self.size, max(self.lasers, more.lasers), tuple(errors), notes)


def new_shots(files: Collection[Path], before: Sequence[Shot]) -> list[Shot]:
    """The poses that files are of, each with its other photographs in the same folder.

    InputError: none is new; two files of one name.
    """
    known = {file for shot in before for file in _files(shot)}
    found = []
    for folder in dict.fromkeys(file.parent for file in files):
        wanted = {file for file in files if file.parent == folder} - known
        found += [shot for shot in shots(folder) if wanted & _files(shot)]
    if not found:
        raise InputError("no photograph that is new", found=", ".join(sorted(file.name for file in files)))
    return found


def _files(shot: Shot) -> set[Path]:
    return {file for file in (shot.board, *shot.lasers.values()) if file is not None}


def photographed(
    taken: Sequence[Shot],
    board: Board,
    settings: ExtractionSettings,
    *,
    lasers: bool,
    progress: Callable[[float], None] = lambda done: None,
) -> Material:
    """From photographs; lasers: with the lines on their boards. InputError: no photograph is usable."""
    found = views_of(taken, board, settings, lasers=lasers, progress=progress)
    count = 1 + max((stripe.laser for view in found.views for stripe in view.stripes), default=-1)
    return Material(found.views, found.size, count, found.errors, found.notes)


def virtual(
    project: Project,
    board: Board,
    nearest: float | None = None,
    farthest: float | None = None,
    *,
    count: int = VIEWS,
    seed: int = SEED,
    most_tilt: float = MOST_TILT,
    sigmas: tuple[float, float] = (SIGMA, SIGMA),
) -> tuple[Material, Estimate]:
    """Virtual boards before the project's camera, one of them carried by its motion where it has one, and the truth.

    nearest, farthest: of them, m; most_tilt rad; sigmas px of corners and lines.
    InputError: the camera sees no such board, or the distances are none.
    """
    views, truth = virtual_views(
        project,
        board,
        count,
        seed=seed,
        depth=board_distances(project, nearest, farthest),
        most_tilt=most_tilt,
        sigmas=sigmas,
    )
    moved, told = carried_views(project, board, truth, seed=seed, sigmas=sigmas), None
    if moved is not None:
        more, truth, told = moved
        views += more
    camera = project.scene.camera
    names = tuple(laser.name for laser in project.scene.lasers)
    return Material(tuple(views), (camera.width, camera.height), len(names), told=told, names=names), truth


def as_advised(material: Material, truth: Estimate, advice: Advice, board: Board) -> Material:
    """The same and a virtual view of the board held where it was advised. InputError: too little of it is seen."""
    number = len(material.views)
    rotation, translation = advised_pose(advice, board)
    there = replace(truth, rotation=rotation[None], translation=translation[None])
    view = exact_view(
        f"view {number}",
        there,
        0,
        board.target,
        material.size,
        corner_sigma=SIGMA,
        laser_sigma=SIGMA,
        laser_step=LASER_STEP,
    )
    if len(view.pixel) < FEWEST:
        found, allowed = f"{len(view.pixel)} corners", f"{FEWEST} or more"
        raise InputError("the camera sees too little of the board there", found=found, allowed=allowed)
    drawn = noisy([view], np.random.default_rng([SEED, number]))
    return replace(material, views=(*material.views, *drawn))


def need_a_line(material: Material, where: str) -> None:
    """InputError: there is no laser to calibrate."""
    if material.lasers == 0:
        cure = "name pairs NAME_on and NAME_off, hold the board where the line crosses it, or find the camera alone"
        raise with_faults(
            InputError("no photograph shows a laser's line on the board", where=where, cure=cure), material
        )


def with_faults(error: InputError, material: Material) -> InputError:
    """The same with the files that were left aside and what was told of views: they may be why there is too little."""
    parts = [error.cure] if error.cure else []
    if material.errors:
        parts += ["photographs that were not used:", *material.errors]
    if material.notes:
        parts += ["of the others:", *material.notes]
    if not material.errors and not material.notes:
        return error
    return InputError(error.what, where=error.where, found=error.found, allowed=error.allowed, cure="\n".join(parts))


def board_distances(project: Project, nearest: float | None, farthest: float | None) -> tuple[float, float]:
    """m, of virtual boards: as asked, else where the lines lie on the parts, LEAST_SPAN about their middle at least.

    Without a line: about where the first laser meets the camera's axis. InputError: the farthest is not beyond the
    nearest.
    """
    first, last = nearest, farthest
    if first is None or last is None:
        low, high = line_depths(project)
        middle = 0.5 * (low + high)
        first = first or min(low, (1.0 - LEAST_SPAN) * middle)
        last = last or max(high, (1.0 + LEAST_SPAN) * middle, (1.0 + 2.0 * LEAST_SPAN) * first)
    if last <= first:
        raise InputError("the farthest distance is not beyond the nearest", where="--farthest", found=last)
    return first, last


def line_depths(project: Project) -> tuple[float, float]:
    """m, least and greatest depth of the lines in view, at the first, the middle and the last step of a motion.

    Of a project without any: about where its first laser meets the camera's axis, else 1 m.
    """
    from studio.preview.preview import Preview

    scene, preview = project.scene, Preview()
    last = scene.motion.frame_count - 1
    looks = [preview.look(project, project.folder, step) for step in sorted({0, last // 2, last})]
    depth = np.concatenate([[], *(look.lit_curve(i).depth_z for look in looks for i in range(len(scene.lasers)))])
    if len(depth):
        return float(depth.min()), float(depth.max())
    plane = scene.laser_plane(0) if scene.lasers else np.array([0.0, 0.0, 1.0, -1.0])
    middle = -plane[3] / plane[2] if abs(plane[2]) > 1e-6 and -plane[3] / plane[2] > 0.0 else 1.0
    return (1.0 - NOWHERE) * float(middle), (1.0 + NOWHERE) * float(middle)
