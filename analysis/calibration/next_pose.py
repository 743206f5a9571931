"""Where to hold the board next: the pose that lessens the depth's variance over the working volume most.

A view adds information I to the shared parameters; with covariance C before, it is (C^-1 + I)^-1 after. The variance of
depth, averaged over the volume, is the trace of that with the depth's derivatives, so that hundreds of poses are tried
in a tenth of a second: first some everywhere, then ever closer about the best one. What is told of that one is worked
out with all the corners and as many laser points as the views so far have.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from analysis.calibration.adjust import view_information
from analysis.calibration.depth import Volume, depth_jacobian
from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise, project
from analysis.calibration.observations import Index, Observations
from render.base.arrays import Bool, Float

ROUNDS, ABOUT = 3, 48
"""Searches about the best pose so far, each over so many poses half as far away as the one before."""
CORNERS = 5
"""Corners a side of the board that stand for all of them in a trial."""
POINTS, MANY_POINTS = 24, 480
"""Laser points a line that stand for all of them, in a trial and in what is told of the best pose."""
AHEAD = 20
"""Views, one after the other, whose depth error is told."""
LEAST_SEEN = 0.24
"""Share of the corners that a view must show to tell anything."""


@dataclass(frozen=True)
class Advice:
    """The best pose of those tried, and the depth error (rms over the volume, m) before and after it."""

    rotation: Float
    """(3, 3) board to camera."""
    centre: Float
    """(3,) m, the board's middle in the camera frame."""
    before: float
    after: float
    ahead: tuple[float, ...] = ()
    """m, after this view and one, two, ... more, each where it gains most of a few poses."""

    @property
    def tilt(self) -> float:
        """rad between the board's normal and the camera's axis."""
        return float(np.arccos(np.clip(abs(self.rotation[2, 2]), 0.0, 1.0)))

    @property
    def gain(self) -> float:
        """m by which the depth error falls."""
        return self.before - self.after

    def views_until(self, wanted: float) -> int | None:
        """Views to a depth error of no more, m; None: more than were looked ahead to."""
        return next((1 + i for i, error in enumerate(self.ahead) if error <= wanted), None)


def advise(
    estimate: Estimate,
    information: Float,
    free: Bool,
    target: Float,
    size: tuple[int, int],
    volumes: list[Volume],
    *,
    most_tilt: float = np.radians(45.0),
    sigmas: tuple[float, float] = (0.05, 0.05),
) -> Advice:
    """information (p, p) of the views so far; target (n, 2) m; most_tilt rad; sigmas px of a corner, and of the
    line at each scan line.

    Distances are those of the volumes.
    """
    depth = np.concatenate([volume.depth for volume in volumes])
    ends = (float(depth.min()), float(depth.max()))
    middle = np.append(0.5 * (target.min(axis=0) + target.max(axis=0)), 0.0)
    used = np.nonzero(free)[0]
    inner = information[np.ix_(used, used)]
    scale = 1.0 / np.sqrt(np.diag(inner))
    both = np.outer(scale, scale)
    weight = _depth_weight(estimate, volumes)[np.ix_(used, used)] * both
    before = float(np.sum(np.linalg.inv(inner * both) * weight))

    least, greatest = target.min(axis=0), target.max(axis=0)
    x, y = np.meshgrid(*(np.linspace(least[i], greatest[i], CORNERS) for i in (0, 1)))
    few = np.column_stack([x.ravel(), y.ravel()])

    def told_by(poses: Estimate, corners: Float = few, points: int = POINTS) -> Float:
        weight_of_one = np.sqrt(len(target) / len(corners)) / sigmas[0]
        return _information(poses, corners, points, size, (weight_of_one, 1.0 / sigmas[1]))[:, used][:, :, used]

    def left(known: Float) -> Float:
        return np.asarray(np.einsum("kij,ji->k", np.linalg.inv(known * both), weight))

    everywhere, rng = _candidates(estimate, middle, ends, most_tilt), np.random.default_rng(0)
    told = told_by(everywhere)
    poses, after = everywhere, left(inner + told)
    for share in 0.5 ** np.arange(ROUNDS):
        near = _about(_one(poses, int(np.argmin(after))), middle, ends, most_tilt, float(share), rng)
        found = left(inner + told_by(near))
        if found.min() < after.min():
            poses, after = near, found
    best = _one(poses, int(np.argmin(after)))
    centre = best.rotation[0] @ np.append(target.mean(axis=0), 0.0) + best.translation[0]
    known = inner + told_by(best, target, MANY_POINTS)
    ahead = [float(left(known)[0])]
    for _ in range(AHEAD - 1):
        next_one = _one(everywhere, int(np.argmin(left(known + told))))
        known = known + told_by(next_one, target, MANY_POINTS)
        ahead.append(float(left(known)[0]))
    errors = tuple(float(np.sqrt(max(variance, 0.0))) for variance in ahead)
    return Advice(best.rotation[0], centre, float(np.sqrt(before)), errors[0], errors)


def _depth_weight(estimate: Estimate, volumes: list[Volume]) -> Float:
    """(p, p) W with mean depth variance = trace(W covariance)."""
    total, count = np.zeros((len(estimate.shared),) * 2), 0
    for volume in volumes:
        q = normalise(volume.pixel, estimate.intrinsics, estimate.distortion)
        jacobian = depth_jacobian(estimate, volume, q)
        total += jacobian.T @ jacobian
        count += len(q)
    return total / max(count, 1)


def _candidates(estimate: Estimate, middle: Float, depth: tuple[float, float], most_tilt: float) -> Estimate:
    """Poses at three distances, tilted to eight sides, with the board's middle on the laser planes or on the axis."""
    rotation, translation = [], []
    for z in np.linspace(depth[0], depth[1], 3):
        on_plane = [np.array([(1.0 - m[2] * z) / m[0], 0.0, z]) for m in estimate.planes if abs(m[0]) > 1e-9]
        places = [np.array([0.0, 0.0, z]), *on_plane]
        for place in places:
            for tilt in (0.0, 0.5 * most_tilt, most_tilt):
                for side in np.arange(8 if tilt > 0.0 else 1) * (np.pi / 4.0):
                    turn = Rotation.from_rotvec([tilt * np.cos(side), tilt * np.sin(side), 0.0]).as_matrix()
                    rotation.append(turn)
                    translation.append(place - turn @ middle)
    return estimate.with_poses(np.array(rotation), np.array(translation))


def _one(poses: Estimate, number: int) -> Estimate:
    return poses.with_poses(poses.rotation[number : number + 1], poses.translation[number : number + 1])


def _about(
    pose: Estimate, middle: Float, depth: tuple[float, float], most_tilt: float, share: float, rng: np.random.Generator
) -> Estimate:
    """Poses about the only one, within the depths and the limit of tilt; share 1 is 20 deg and a tenth of the depth."""
    turned = Rotation.from_rotvec(share * np.radians(20.0) * rng.normal(size=(ABOUT, 3))).as_matrix() @ pose.rotation
    over = np.maximum(np.arccos(np.clip(turned[:, 2, 2], -1.0, 1.0)) - most_tilt, 0.0)
    axis = np.cross(turned[:, :, 2], [0.0, 0.0, 1.0])
    axis /= np.maximum(np.linalg.norm(axis, axis=1), 1e-12)[:, None]
    turned = Rotation.from_rotvec(over[:, None] * axis).as_matrix() @ turned
    place = pose.rotation[0] @ middle + pose.translation[0]
    place = place + 0.1 * share * place[2] * rng.normal(size=(ABOUT, 3))
    place[:, 2] = np.clip(place[:, 2], *depth)
    return pose.with_poses(turned, place - turned @ middle)


def _information(
    poses: Estimate, corners: Float, points: int, size: tuple[int, int], weights: tuple[float, float]
) -> Float:
    """(poses, p, p) of views with corners (n, 2) m and so many laser points a line.

    weights: 1/px of a corner, and of the line at each scan line.
    """
    least, greatest = corners.min(axis=0), corners.max(axis=0)
    count = len(poses.rotation)
    all_corners = np.tile(corners, (count, 1))
    view = np.repeat(np.arange(count), len(corners))
    pixel, seen = _pixels(poses, view, all_corners, size)
    numbers, lasers = np.repeat(np.arange(count), points), range(len(poses.planes))
    laser_view = np.concatenate([np.empty(0, dtype=np.intp), *(numbers for _ in lasers)])
    laser = np.repeat(np.arange(len(poses.planes)), len(numbers))
    lines = [_line(poses, m, least, greatest, points).reshape(-1, 2) for m in poses.planes]
    line = np.concatenate([np.empty((0, 2)), *lines])
    on = np.all((line >= least) & (line <= greatest), axis=1)
    line_pixel, line_seen = _pixels(poses, laser_view, line, size)
    along = np.array([0 if abs(m[0]) >= abs(m[1]) else 1 for m in poses.planes], dtype=np.intp)[laser]
    # each point stands for the scan lines up to the next
    ends = line_pixel.reshape(-1, points, 2)
    rows = np.abs(np.nan_to_num(ends[:, -1] - ends[:, 0])) / (points - 1)
    rows = np.repeat(rows, points, axis=0)[np.arange(len(along)), 1 - along]
    middle = 0.5 * (least + greatest)
    trial = Observations(
        names=("",) * count,
        lasers=len(poses.planes),
        view=view,
        pixel=pixel,
        target=all_corners,
        whitening=np.eye(2) * (weights[0] * seen)[:, None, None],
        laser_view=laser_view,
        laser=laser,
        laser_pixel=np.nan_to_num(line_pixel),
        laser_weight=np.where(on & line_seen, np.sqrt(rows) * weights[1], 0.0),
        along=along,
        centre=middle,
        half=0.5 * (greatest - least),
    )
    # sorted by view, as sums by view need it
    order = np.argsort(laser_view, kind="stable")
    trial = replace(
        trial,
        **{
            name: getattr(trial, name)[order]
            for name in ("laser_view", "laser", "laser_pixel", "laser_weight", "along")
        },
    )
    enough = np.bincount(view, weights=seen, minlength=count) >= LEAST_SEEN * len(corners)
    out = view_information(trial, poses, start=_rays(poses, laser_view[order], line[order]))
    return np.where(enough[:, None, None], out, 0.0)


def _line(poses: Estimate, m: Float, least: Float, greatest: Float, points: int) -> Float:
    """(poses, points, 2) m, places on each board's plane along the laser's line, over the board's diagonal."""
    across = np.einsum("kij,i->kj", poses.rotation, m)[:, :2]
    offset = 1.0 - poses.translation @ m
    middle = 0.5 * (least + greatest)
    squared = np.maximum(np.sum(across**2, axis=1), 1e-12)
    foot = middle + across * ((offset - across @ middle) / squared)[:, None]
    direction = np.column_stack([-across[:, 1], across[:, 0]]) / np.sqrt(squared)[:, None]
    reach = 0.5 * np.linalg.norm(greatest - least) * np.linspace(-1.0, 1.0, points)
    return np.asarray(foot[:, None, :] + reach[None, :, None] * direction[:, None, :])


def _rays(poses: Estimate, view: Index, place: Float) -> Float:
    """(n, 2) normalised, of places (n, 2) on the flat boards of some views (n,); off where they are not ahead."""
    flat = np.column_stack([place, np.zeros(len(place))])
    point = np.einsum("nij,nj->ni", poses.rotation[view], flat) + poses.translation[view]
    return np.asarray(point[:, :2] / np.maximum(point[:, 2:], 1e-3))


def _pixels(poses: Estimate, view: Index, place: Float, size: tuple[int, int]) -> tuple[Float, Bool]:
    """(n, 2) px, and (n,) inside the image."""
    pixel, _, _ = project(_rays(poses, view, place), poses.intrinsics, poses.distortion)
    return pixel, np.all((pixel >= 0.0) & (pixel <= np.array(size) - 1.0), axis=1)
