"""A checkerboard with a marker in its middle is known in any part and turn of it that shows the marker."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from analysis.calibration.board import Board
from analysis.calibration.detect import detect, on_board
from render.base.errors import InputError
from studio.calibration.board_mesh import coverage

BOARD = Board("checkerboard", 13, 9, 0.025, dotted=True)
SCALE = 32.0
"""px of a square, and of the white about the board."""


def picture() -> np.ndarray:
    """(384, 512) 8 bit, the board from straight ahead: a corner of column i is at (2 + i) SCALE - 0.5 px."""
    dark = cv2.resize(coverage(BOARD), (512, 384), interpolation=cv2.INTER_AREA)
    image = cv2.GaussianBlur(200.0 - 140.0 * dark, (0, 0), 0.8)
    return np.rint(image + np.random.default_rng(0).normal(size=image.shape)).astype(np.uint8)


def expected(target: np.ndarray) -> np.ndarray:
    return (target / BOARD.square + 2.0) * SCALE - 0.5


@pytest.mark.parametrize(
    ("left", "top", "corners"), [(0, 0, 117), (100, 0, 99), (100, 130, 66)], ids=["whole", "left cut off", "two sides"]
)
@pytest.mark.parametrize("quarters", [0, 1, 2])
def test_what_is_seen_of_it_is_known_by_the_marker(left: int, top: int, corners: int, quarters: int) -> None:
    part = picture()[top:, left:]
    turned = np.ascontiguousarray(np.rot90(part, quarters))
    view, _ = detect(turned, BOARD, "view")
    assert len(view.pixel) == corners
    there, width, height = expected(view.target) - [left, top], part.shape[1], part.shape[0]
    for _ in range(quarters):  # as rot90, to the left: what was at the right is at the top
        there, width, height = np.stack([there[:, 1], width - 1.0 - there[:, 0]], axis=1), height, width
    assert np.abs(view.pixel - there).max() < 0.1


def test_a_mirrored_one_is_told_and_a_part_without_the_marker_as_well() -> None:
    with pytest.raises(InputError, match="the board is mirrored"):
        detect(np.ascontiguousarray(picture()[:, ::-1]), BOARD, "view")
    with pytest.raises(InputError, match="its marker is to be seen"):
        detect(np.ascontiguousarray(picture()[:, 290:]), BOARD, "view")


def test_opencv_finds_the_same_marker() -> None:
    found, _, squares = cv2.findChessboardCornersSBWithMeta(picture(), (13, 9), cv2.CALIB_CB_MARKER)
    assert found
    # 4 is a light square with a dark dot, 3 a dark one with a light dot
    row, column = (int(place[0]) for place in np.nonzero(squares == 4)) if np.sum(squares == 4) == 1 else (-1, -1)
    assert (column + 1, row + 1) in {tuple(dot) for dot in BOARD.dots} and np.sum(squares == 3) >= 1


def test_a_line_is_not_taken_on_the_edge_of_a_dot() -> None:
    view, _ = detect(picture(), BOARD, "view")
    row = np.full(400, expected((BOARD.dots[0] - 0.5) * BOARD.square)[1])
    u = np.linspace(60.0, 460.0, 400)
    kept = on_board(view, BOARD, np.column_stack([u, row]), 3.0)
    plain = on_board(view, Board("checkerboard", 13, 9, 0.025), np.column_stack([u, row]), 3.0)
    lost = u[plain & ~kept]
    # within 3 px of either edge of the only dot of the row, whose radius is 5.44 px
    away = np.abs(lost - expected((BOARD.dots[0] - 0.5) * BOARD.square)[0])
    assert len(lost) and np.all(np.abs(away - 0.17 * SCALE) < 3.5)
