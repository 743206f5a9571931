"""The calibration that a project holds, as a person reads it: what its file stores, without views and checks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from analysis.calibration.depth import DepthError, depth_error, depth_off, working_volume
from analysis.calibration.estimate import INTRINSICS, Estimate, plane_vector
from analysis.calibration.lens import NAMES
from render.base.arrays import Float
from render.base.errors import InputError
from studio.calibration.in_silico import truth_of
from studio.calibration.known import known_laser
from studio.calibration.material import board_distances
from studio.calibration.motion_file import rows_of_motion
from studio.calibration.words import camera_rows, plane_rows, span_of
from studio.project.project import Project

THROUGH = 1e-6
"""m of a laser plane from the camera's centre, within which no depth can be measured by it."""


@dataclass(frozen=True)
class OwnDepth:
    """What the calibration does to depth over a laser's volume."""

    laser: int
    told: DepthError
    """Its `random` is of no line: a project stores none."""
    true: float | None
    """m rms, off the scene's camera and plane; None: they cannot be compared."""


def own_rows(project: Project) -> list[tuple[str, str, str]]:
    """Name, value and sigma of what points are made with; "exact" where no covariance is stored."""
    scene, given = project.scene, project.calibration
    camera = given.camera_of(scene.camera)
    rows = [("image px", f"{camera.width} x {camera.height}", "")]
    values = [*(getattr(camera, name) for name in INTRINSICS), *camera.distortion]
    names = (*INTRINSICS, *NAMES[: len(camera.distortion)])
    rows += camera_rows(names, values, _camera_sigma(project, len(values)))
    for i, laser in enumerate(scene.lasers):
        plane = given.plane(i, scene.laser_plane(i))
        if abs(plane[3]) < THROUGH:
            continue
        covariance = given.covariance(i)
        own = None if covariance is None else known_laser(plane, covariance).covariance[-3:, -3:]
        rows += plane_rows(laser.name, plane_vector(plane), own)
    if given.motion is not None:
        rows += rows_of_motion(given.motion.model_dump())
    return rows


def own_notes(project: Project) -> list[str]:
    """Sentences on what is not of the calibration, or not stored."""
    given = project.calibration
    notes = []
    if given.camera is None:
        notes.append("The camera is the scene's: the calibration has none.")
    if given.laser_count and not given.planes:
        notes.append("The laser planes are the scene's: the calibration has none.")
    if not given.covariances:
        notes.append("No covariance is stored: points take it as exact.")
    notes.append("The project stores neither its views nor its checks.")
    return notes


def own_depth(project: Project) -> list[OwnDepth]:
    """For each laser that sees some of them, over the distances at which virtual boards would be held.

    project: in its folder, as its meshes are read. InputError: one of them cannot be.
    """
    nearest, farthest = board_distances(project, None, None)
    camera = project.scene.camera
    found = []
    for laser in range(len(project.scene.lasers)):
        estimate = _estimate(project, laser)
        if estimate is None:
            continue
        volume = working_volume(estimate, 0, (camera.width, camera.height), nearest, farthest)
        if not len(volume.depth):
            continue
        told, truth = depth_error(estimate, _shared_covariance(project, laser, estimate), volume, 0.0), _truth(project)
        true = None
        if truth is not None:
            one = replace(truth, planes=truth.planes[laser][None])
            true = float(np.sqrt(np.mean(depth_off(estimate, one, volume) ** 2)))
        found.append(OwnDepth(laser, told, true))
    return found


def own_depth_rows(project: Project, found: Sequence[OwnDepth]) -> list[tuple[str, ...]]:
    """For each laser: rms and greatest systematic error told, and the true one; um, "-" where it is not known."""
    rows = []
    for one in found:
        stored = bool(project.calibration.covariances)
        told = [one.told.rms, float(one.told.systematic.max())] if stored else [None, None]
        cells = ("-" if value is None else f"{1e6 * value:.1f}" for value in (*told, one.true))
        rows.append((span_of(project.scene.lasers[one.laser].name, one.told.volume), *cells))
    return rows


def _truth(project: Project) -> Estimate | None:
    try:
        return truth_of(project)
    except InputError:
        return None


def _camera_sigma(project: Project, count: int) -> Float | None:
    """(count,) of the camera's parameters, NaN of a lens that is exact; None: all of it is."""
    covariance = project.calibration.covariance(0)
    if covariance is None:
        return None
    variance = np.diag(covariance)
    sigma = np.full(count, np.nan)
    known = np.sqrt(np.maximum(np.concatenate([variance[:4], variance[8:]]), 0.0))
    sigma[: len(known)] = known
    return sigma


def _estimate(project: Project, laser: int) -> Estimate | None:
    """Camera and plane of one laser as they were found; None: its plane passes through the camera's centre."""
    scene, given = project.scene, project.calibration
    camera, plane = given.camera_of(scene.camera), given.plane(laser, scene.laser_plane(laser))
    if abs(plane[3]) < THROUGH:
        return None
    values: dict[str, Any] = {
        "intrinsics": np.array([getattr(camera, name) for name in INTRINSICS]),
        "distortion": np.array(camera.distortion),
        "planes": plane_vector(plane)[None],
    }
    return Estimate(warp=np.zeros(2), rotation=np.empty((0, 3, 3)), translation=np.empty((0, 3)), **values)


def _shared_covariance(project: Project, laser: int, estimate: Estimate) -> Float:
    """(p, p) of the estimate's shared parameters; zero where nothing is stored."""
    out = np.zeros((len(estimate.shared), len(estimate.shared)))
    covariance = project.calibration.covariance(laser)
    if covariance is None:
        return out
    plane = project.calibration.plane(laser, project.scene.laser_plane(laser))
    known = known_laser(plane, covariance).covariance
    at = np.concatenate([np.arange(len(known) - 3), np.arange(len(out))[estimate.plane_slice(0)]])
    out[np.ix_(at, at)] = known
    return out
