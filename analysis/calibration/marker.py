"""The marker in the middle of a checkerboard: three dots in an L, which tell what part of the board is seen.

Its dots are those of OpenCV's boards with a marker, so that its detector finds them as well.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.calibration.board import ELL, Board
from render.base.arrays import Bool, Float
from render.base.errors import InputError

CLEARLY = 0.4
"""Of the contrast of the squares: how much a dot differs from what is about it."""
MIDDLE, AROUND = 0.06, 0.32
"""Squares from the middle of one: where a dot is looked for, and where it is compared with."""
EIGHT = np.pi / 4.0 * np.arange(8)


def by_marker(shown: NDArray[np.uint8], grid: Float, board: Board) -> tuple[Float, NDArray[np.intp]] | None:
    """(n, 2) px and (n,) numbers on the board, of a grid of corners (rows, columns, 2) px found in an image (h, w).

    The grid may be turned, and a part of the board. None: the marker is not seen. InputError: the board is mirrored.
    """
    if np.linalg.det([grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]]) < 0.0:
        grid = grid[:, ::-1]
    y, x = np.nonzero(dotted(shown, grid))
    seen = np.stack([x, y], axis=1) + 0.5
    if len(seen) != len(ELL):
        return None
    apart = np.abs(seen[:, None] - seen).sum(axis=2)
    bend = int(np.argmin(apart.sum(axis=1)))
    arms = np.delete(seen, bend, axis=0) - seen[bend]
    if apart.sum() != 8.0 or abs(np.linalg.det(arms)) != 1.0:  # ends are two from each other, and not in line
        return None
    arms = arms if np.linalg.det(arms) > 0.0 else arms[::-1]
    rows, columns = np.mgrid[0 : grid.shape[0], 0 : grid.shape[1]]
    index = np.stack([columns.ravel(), rows.ravel()], axis=1)
    for mirrored in (False, True):
        turn = np.linalg.solve(arms[::-1] if mirrored else arms, ELL[[0, 2]] - ELL[1])
        place = np.rint((index - seen[bend]) @ turn + board.dots[1] - 0.5).astype(np.intp)
        if np.all((place >= 0) & (place < [board.columns, board.rows])):
            if mirrored:
                raise InputError("the board is mirrored", cure="turn off the mirroring of camera or converter")
            return grid.reshape(-1, 2), place[:, 1] * board.columns + place[:, 0]
    return None


def dotted(shown: NDArray[np.uint8], grid: Float) -> Bool:
    """(rows - 1, columns - 1): which squares between corners (rows, columns, 2) px have a dot of the other colour."""
    circle = np.stack([np.cos(EIGHT), np.sin(EIGHT)], axis=1)
    share = 0.5 + np.concatenate([MIDDLE * circle, AROUND * circle])
    corners = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, :-1], grid[1:, 1:]], axis=2)
    x, y = share.T
    place = np.stack([(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y], axis=1) @ corners
    flat = place.reshape(len(corners), -1, 2).astype(np.float32)
    values = cv2.remap(shown, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR).reshape(place.shape[:3])
    middle, around = (np.median(part, axis=2) for part in np.split(values.astype(np.float64), 2, axis=2))
    even = np.add.outer(*(np.arange(side) for side in around.shape)) % 2 == 0
    contrast = abs(np.median(around[even]) - np.median(around[~even]))
    return np.asarray(np.abs(middle - around) > CLEARLY * contrast)
