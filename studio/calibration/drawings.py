"""What is drawn of a calibration in the camera's image: boards, arrows, coverage; and the depth error as a map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from analysis.calibration.lens import normalise, project
from render.base.arrays import Float
from render.output.tone_mapping import Picture, colour, grey, pyramid
from studio.photographs.image_files import load_photograph

if TYPE_CHECKING:
    from analysis.calibration.board import Board
    from analysis.calibration.depth import DepthError
    from analysis.calibration.estimate import Estimate
    from analysis.calibration.next_pose import Advice
    from analysis.calibration.observations import View

TENTHS = 10
"""Cells a side in which coverage is counted, as the check of the set does."""
LONGEST = 1.0 / 30.0
"""Of the image's width: a typical arrow."""
EDGE = 12
"""Points that an edge of the board is drawn with, as a lens bends it."""
MAP = (160, 120)
"""Cells of the map, across and in depth."""


def seen_at(points: Float, estimate: Estimate) -> Float:
    """(n, 3) m in the camera frame -> (n, 2) px; NaN behind the camera and beyond the fold of the lens."""
    ahead = np.where(points[:, 2:] > 1e-6, points[:, 2:], np.nan)
    with np.errstate(invalid="ignore"):
        pixel, by_q, _ = project(points[:, :2] / ahead, estimate.intrinsics, estimate.distortion)
        pixel[~(np.linalg.det(np.nan_to_num(by_q)) > 0.0)] = np.nan
    return pixel


def dark_shapes(board: Board) -> Float:
    """(k, 4, 2) m on the board, corners of its dark squares; of discs (k, EDGE, 2)."""
    if board.kind == "circles":
        angle = np.arange(EDGE) * (2.0 * np.pi / EDGE)
        return np.asarray(board.target[:, None] + board.circle * np.column_stack([np.cos(angle), np.sin(angle)]))
    j, i = np.mgrid[-1 : board.rows, -1 : board.columns]
    dark = (i + j) % 2 == 0
    low = np.stack([i[dark], j[dark]], axis=1)
    return np.asarray((low[:, None, :] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) * board.square)


def dark_squares(board: Board, estimate: Estimate, rotation: Float, translation: Float) -> Float:
    """(k, m, 2) px, the dark shapes in a pose, those that can be seen as a whole."""
    shapes = in_space(dark_shapes(board), rotation, translation)
    pixel = seen_at(shapes.reshape(-1, 3), estimate).reshape(*shapes.shape[:2], 2)
    return np.asarray(pixel[np.isfinite(pixel).all(axis=(1, 2))])


def in_space(shapes: Float, rotation: Float, translation: Float) -> Float:
    """(k, m, 2) m on the board -> (k, m, 3) m in the camera frame."""
    return np.asarray(shapes @ rotation[:, :2].T + translation)


def outline(board: Board, estimate: Estimate, rotation: Float, translation: Float) -> Float:
    """(4 EDGE + 1, 2) px, the board's edge in a pose, closed."""
    low, high = np.array([-1.0, -1.0]), np.array([board.columns, board.rows], dtype=np.float64)
    share = np.linspace(0.0, 1.0, EDGE, endpoint=False)[:, None]
    turns = np.array([low, [high[0], low[1]], high, [low[0], high[1]], low]) * board.square
    place = np.concatenate([a + share * (b - a) for a, b in pairwise(turns)] + [turns[-1:]])
    flat = np.column_stack([place, np.zeros(len(place))])
    return seen_at(flat @ rotation.T + translation, estimate)


def advised_pose(advice: Advice, board: Board) -> tuple[Float, Float]:
    """(3, 3) and (3,) m, of the board's first corner."""
    middle = np.append(0.5 * board.extent[1], 0.0)
    return advice.rotation, advice.centre - advice.rotation @ middle


def arrow_scale(off: Float, width: int) -> float:
    """1, 2 or 5 times a power of ten, so that a typical residual (n, 2) px is drawn as `LONGEST` of the image."""
    typical = float(np.sqrt(np.mean(np.sum(off**2, axis=1)))) if len(off) else 0.0
    if not typical > 0.0:
        return 1.0
    wanted = LONGEST * width / typical
    power = 10.0 ** np.floor(np.log10(wanted))
    return float(max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted * (1.0 + 1e-9)))


def covered(views: Sequence[View], size: tuple[int, int]) -> Float:
    """(10, 10) corners in each tenth of the image's height and width."""
    pixel = np.concatenate([np.empty((0, 2)), *(view.pixel for view in views)])
    cell = (np.clip(pixel / np.array(size), 0.0, 0.999) * TENTHS).astype(int)
    out = np.zeros((TENTHS, TENTHS))
    np.add.at(out, (cell[:, 1], cell[:, 0]), 1.0)
    return out


@dataclass(frozen=True)
class DepthMap:
    """The systematic depth error over a laser's plane."""

    laser: int
    sigma: Float
    """(depths, places across) m; NaN where nothing is seen."""
    across: tuple[float, float]
    """m, along the line."""
    depth: tuple[float, float]
    """m, along the camera's axis."""


def depth_map(one: DepthError, estimate: Estimate) -> DepthMap:
    """Of one laser, interpolated between the points of its working volume."""
    from scipy.interpolate import griddata
    from scipy.spatial import QhullError

    volume, m = one.volume, estimate.planes[one.volume.laser]
    along = 1 if abs(m[0]) >= abs(m[1]) else 0
    place = normalise(volume.pixel, estimate.intrinsics, estimate.distortion)[:, along] * volume.depth
    across = float(place.min()), float(place.max())
    depth = float(volume.depth.min()), float(volume.depth.max())
    x, z = np.meshgrid(np.linspace(*across, MAP[0]), np.linspace(*depth, MAP[1]))
    wide, deep = max(np.ptp(across), 1e-9), max(np.ptp(depth), 1e-9)
    scaled = np.column_stack([place / wide, volume.depth / deep])
    try:
        sigma = griddata(scaled, one.systematic, (x / wide, z / deep), method="linear")
    except (QhullError, ValueError):  # too few points, or all of them on one line
        sigma = np.full(x.shape, np.nan)
    return DepthMap(volume.laser, np.asarray(sigma), across, depth)


def levels_of(file: Path) -> list[Picture]:
    """A photograph as it is shown, with its halves; dark and bright ends are clipped by a thousandth each.

    InputError: as `load_photograph`.
    """
    image = load_photograph(file).astype(np.float32)
    some = image[::4, ::4]
    low, high = float(np.quantile(some, 0.001)), float(np.quantile(some, 0.999))
    return pyramid(grey(image, low, high) if image.ndim == 2 else colour(image, high))
