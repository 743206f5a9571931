"""From a photograph to a view: which corners of the board are in it, and which of them can be trusted."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from analysis.calibration.board import Board
from analysis.calibration.circles import find_circles, refine_circles
from analysis.calibration.corners import noise_of, refine
from analysis.calibration.marker import by_marker
from analysis.calibration.observations import View
from analysis.line.result import Axis
from render.base.arrays import Bool, Float
from render.base.errors import InputError

FEWEST = 8
"""Corners that a view needs."""
THICKEST_LINE = 15
"""px of a laser's line that is taken away where it hides the board."""
SMALLEST = (3, 3)
"""Corners of a board of which another number is told."""
LOOKED_THROUGH = 1600
"""px of the longer side of an image in which a board is looked for first."""
SAMPLE = 2**18
"""Pixels that tell the darkest and the brightest of an image."""
GLARE = 0.02
"""Share of full-scale pixels about a corner above which it is dropped."""


def grey(image: NDArray[Any]) -> Float:
    """(h, w) or (h, w, 3) of any type -> (h, w) float64 of the same numbers; colours are averaged."""
    return np.asarray(image if image.ndim == 2 else image.mean(axis=2), dtype=np.float64)


def detect(image: NDArray[Any], board: Board, name: str) -> tuple[View, list[str]]:
    """The board's corners with their covariances, and what was dropped, in words.

    image (h, w) or (h, w, 3), any type. InputError: no board, too few of its corners, another number of squares.
    """
    values = grey(image)
    shown = _eight_bit(values)
    pixel, number = {"charuco": _charuco, "checkerboard": _checkerboard, "circles": _circles}[board.kind](shown, board)
    noise = noise_of(values)
    if board.kind == "circles":
        refined, covariance, good = refine_circles(values, pixel, spacing(pixel), noise)
        dropped = "discs that are cut off or not round dropped"
    else:
        # twice, as the surroundings that are looked at are those of where a corner was thought to be
        refined, _, near = refine(values, pixel, noise, board.clear)
        refined, covariance, good = refine(values, np.where(near[:, None], refined, pixel), noise, board.clear)
        good &= near
        dropped = "corners without a clear crossing dropped"
    notes = []
    strayed = int(np.count_nonzero(~good))
    if strayed:
        notes.append(f"{strayed} {dropped}")
    glaring = good & _glare(image, refined)
    if glaring.any():
        notes.append(f"{int(glaring.sum())} corners in glare dropped")
    good &= ~glaring
    if np.count_nonzero(good) < FEWEST:
        raise InputError(
            "too few corners of the board are usable",
            where=name,
            found=f"{int(np.count_nonzero(good))} of {len(board.target)}",
            allowed=f"{FEWEST} or more",
            cure="show more of the board, sharp and without glare",
        )
    return View(name, refined[good], covariance[good], board.target[number[good]]), notes


def on_board(view: View, board: Board, pixel: Float, margin: float, axis: Axis = "rows") -> Bool:
    """(m, 2) px -> (m,) on the board between its outermost seen corners, `margin` px along the scan line from any edge.

    A line that crosses from white to black is pulled to the white side, by far more than its sigma.
    """
    if len(pixel) == 0:
        return np.zeros(0, dtype=bool)
    homography, _ = cv2.findHomography(view.pixel, view.target)
    beside = pixel + np.array([margin, 0.0] if axis == "rows" else [0.0, margin])
    place, stepped = (cv2.perspectiveTransform(each.reshape(1, -1, 2), homography)[0] for each in (pixel, beside))
    least, greatest = view.target.min(axis=0), view.target.max(axis=0)
    inside = np.all((place > least) & (place < greatest), axis=1)
    first, last = place / board.square, stepped / board.square
    back = 2.0 * first - last
    centres, radius = board.discs
    if len(centres):
        between = (np.linspace(-1.0, 1.0, 9)[:, None, None] * (last - first) + first) * board.square
        on_disc = cKDTree(centres).query(between)[0] < radius
        inside &= (on_disc == on_disc[0]).all(axis=0)
    if board.kind == "circles":
        return np.asarray(inside)
    clear = np.all((np.floor(first) == np.floor(last)) & (np.floor(first) == np.floor(back)), axis=1)
    return np.asarray(inside & clear)


def without_corners(view: View, near: Bool) -> View:
    """The view without some of its corners (n,)."""
    keep = ~near
    return View(view.name, view.pixel[keep], view.covariance[keep], view.target[keep], view.stripes)


def _eight_bit(values: Float) -> NDArray[np.uint8]:
    some = values.ravel()[:: 1 + values.size // SAMPLE]
    low, high = float(np.quantile(some, 0.001)), float(np.quantile(some, 0.999))
    return np.asarray(np.clip((values - low) * (255.0 / max(high - low, 1e-12)), 0, 255), dtype=np.uint8)


def _checkerboard(shown: NDArray[np.uint8], board: Board) -> tuple[Float, NDArray[np.intp]]:
    size = (board.columns, board.rows)
    for image, factor, flags in _ways(shown):
        found, corners = cv2.findChessboardCornersSB(image, size, flags=flags)
        if found:
            pixel = _at_full_size(corners, factor)
            known = by_marker(shown, pixel.reshape(board.rows, board.columns, 2), board) if board.dotted else None
            return known or (pixel, np.arange(len(pixel)))
        if board.dotted:
            larger, corners, squares = cv2.findChessboardCornersSBWithMeta(image, SMALLEST, flags | cv2.CALIB_CB_LARGER)
            part = _at_full_size(corners, factor).reshape(*squares.shape, 2) if larger else None
            if part is not None and (known := by_marker(shown, part, board)):
                return known
    larger, _, squares = cv2.findChessboardCornersSBWithMeta(
        shown, SMALLEST, cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_LARGER
    )
    counted = sorted(squares.shape, reverse=board.columns > board.rows) if larger else sorted(size)
    hidden = "; of a board that is cut off its marker is to be seen" if board.dotted else ", all of them seen"
    raise InputError(
        "no checkerboard of that size is in the image",
        found=None if sorted(counted) == sorted(size) else "one of {} x {}".format(*counted),
        allowed=f"{board.columns} x {board.rows} inner corners{hidden}",
        cure="count the corners where four squares meet, and show the whole board with a white margin",
    )


def _ways(shown: NDArray[np.uint8]) -> Iterator[tuple[NDArray[np.uint8], int, int]]:
    """Images to look for a checkerboard in, by how much they are smaller, and how: what is quick and mostly does first.

    Corners are refined in the image itself, so that a large one is looked through at half or a quarter of its size.
    """
    accurate, evened = cv2.CALIB_CB_ACCURACY, cv2.CALIB_CB_NORMALIZE_IMAGE
    # a laser's line, which is bright and narrow, may hide the board
    thinned = cv2.morphologyEx(shown, cv2.MORPH_OPEN, np.ones((1, THICKEST_LINE), dtype=np.uint8))
    factor = 1
    while max(shown.shape) > factor * LOOKED_THROUGH:
        factor *= 2
    if factor > 1:
        smaller = [
            cv2.resize(one, None, fx=1 / factor, fy=1 / factor, interpolation=cv2.INTER_AREA)
            for one in (shown, thinned)
        ]
        yield from ((one, factor, flags) for one in smaller for flags in (evened, 0))
        accurate = 0
    # evened out, the blocks of a compressed image stand out as its squares do
    yield from ((one, 1, flags | accurate) for one in (shown, thinned) for flags in (evened, 0))
    yield shown, 1, evened | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE


def _at_full_size(corners: Any, factor: int) -> Float:
    """(n, 2) px of the image that was made smaller by a factor."""
    return (np.asarray(corners, dtype=np.float64).reshape(-1, 2) + 0.5) * factor - 0.5


def _charuco(shown: NDArray[np.uint8], board: Board) -> tuple[Float, NDArray[np.intp]]:
    detector = cv2.aruco.CharucoDetector(board.charuco())
    corners, numbers, _, markers = detector.detectBoard(shown)
    if numbers is None or len(numbers) < FEWEST:
        _, flipped, _, _ = detector.detectBoard(np.ascontiguousarray(shown[:, ::-1]))
        if flipped is not None and len(flipped) >= FEWEST:
            raise InputError("the board is mirrored", cure="turn off the mirroring of camera or converter")
        seen = 0 if markers is None else len(markers)
        cure = "check the dictionary and the numbers of squares; boards made before OpenCV 4.6 need the legacy layout"
        raise InputError("no ChArUco board of that kind is in the image", found=f"{seen} of its markers", cure=cure)
    return np.asarray(corners, dtype=np.float64).reshape(-1, 2), np.asarray(numbers, dtype=np.intp).ravel()


def _circles(shown: NDArray[np.uint8], board: Board) -> tuple[Float, NDArray[np.intp]]:
    pixel = find_circles(shown, board.columns, board.rows)
    if pixel is None:
        raise InputError(
            "no circle grid of that size is in the image",
            allowed=f"{board.columns} x {board.rows} dark discs, all of them seen",
            cure="count the discs, and show the whole grid with a white margin",
        )
    return pixel, np.arange(len(pixel))


def spacing(pixel: Float) -> Float:
    """(n,) px to the nearest other."""
    apart = np.linalg.norm(pixel[:, None] - pixel, axis=2)
    np.fill_diagonal(apart, np.inf)
    return np.asarray(apart.min(axis=1))


def _glare(image: NDArray[Any], corner: Float) -> Bool:
    """(n,): saturated about the corner."""
    if not np.issubdtype(image.dtype, np.integer):
        return np.zeros(len(corner), dtype=bool)
    full = (image if image.ndim == 2 else image.max(axis=2)) >= np.iinfo(image.dtype).max
    near = cv2.blur(full.astype(np.float32), (13, 13))
    x, y = (np.clip(np.rint(corner[:, i]).astype(int), 0, full.shape[1 - i] - 1) for i in (0, 1))
    return np.asarray(near[y, x] > GLARE)
