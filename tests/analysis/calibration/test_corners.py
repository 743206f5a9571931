"""Corners: unbiased, with a covariance that their errors have; boards that are not there are told."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from analysis.calibration.board import Board
from analysis.calibration.corners import noise_of
from analysis.calibration.detect import detect, on_board
from render.base.errors import InputError

CHECKERS = Board("checkerboard", 9, 6, 0.025)
CHARUCO = Board("charuco", 8, 5, 0.025, 0.018)
FINE = 8


def drawing(board: Board, square: int) -> np.ndarray:
    """The board at `square` px a square, with a margin of one square, 60 to 200."""
    if board.kind == "charuco":
        size = ((board.columns + 1) * square, (board.rows + 1) * square)
        inner = board.charuco().generateImage(size) > 127
    else:
        y, x = np.mgrid[0 : (board.rows + 1) * square, 0 : (board.columns + 1) * square]
        inner = (x // square + y // square) % 2 == 1
    return np.where(np.pad(inner, square, constant_values=True), 200.0, 60.0)


def photograph(board: Board, turn: float, blur: float = 0.8) -> tuple[np.ndarray, np.ndarray]:
    """A blurred image without noise, 720 x 540, and where the corners truly are in it, (n, 2)."""
    flat = drawing(board, 20 * FINE)
    c, s = np.cos(turn), np.sin(turn)
    place = np.array([[2.1 * c, -2.1 * s, 60.3 + 90.0 * s], [2.0 * s, 2.05 * c, 50.6], [2e-4, 1e-4, 1.0]])
    # pixel centres at integers: pixel i of the drawing is its place (i + 0.5) / (20 FINE) squares from the edge
    shrink = np.array([[1 / FINE, 0.0, 0.5 / FINE], [0.0, 1 / FINE, 0.5 / FINE], [0.0, 0.0, 1.0]])
    grow = np.diag([4.0, 4.0, 1.0])
    grow[:2, 2] = 1.5
    big = cv2.warpPerspective(flat, grow @ place @ shrink, (720 * 4, 540 * 4), flags=cv2.INTER_AREA, borderValue=200.0)
    big = cv2.GaussianBlur(big, (0, 0), 4.0 * blur)
    image = big.reshape(540, 4, 720, 4).mean(axis=(1, 3))
    corners = (board.target / board.square + 2.0) * 20.0
    return image, cv2.perspectiveTransform(corners[None], place)[0]


@pytest.mark.parametrize("turn", [0.3, pytest.param(0.0, marks=pytest.mark.validation)])
def test_corners_err_as_their_covariance_says(turn: float) -> None:
    exact, truth = photograph(CHECKERS, turn)
    rng, chi2, errors = np.random.default_rng(1), [], []
    for _ in range(10):
        noisy = exact + rng.normal(size=exact.shape) * np.sqrt(1.0 + 0.02 * exact)
        view, notes = detect(noisy, CHECKERS, "image")
        assert not notes
        # the detector may begin at either end of the board
        order = truth if np.linalg.norm(view.pixel[0] - truth[0]) < 5.0 else truth[::-1]
        error = view.pixel - order
        errors.append(error)
        chi2.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(view.covariance), error))
    bias = np.mean(errors, axis=0)
    assert np.abs(np.mean(bias, axis=0)).max() < 0.003
    random = np.array(errors) - bias
    inverse = np.linalg.inv(view.covariance)
    ratio = np.einsum("kni,nij,knj->", random, inverse, random) / (2 * 54 * 9)
    assert abs(ratio - 1.0) < 0.1
    assert abs(np.mean(chi2) / 2.0 - 1.0) < 0.25  # the drawing's own pixels are a part of it


def test_the_noise_is_that_of_the_image() -> None:
    exact, _ = photograph(CHECKERS, 0.1)
    noisy = exact + np.random.default_rng(2).normal(size=exact.shape) * np.sqrt(2.0 + 0.05 * exact)
    a, b = noise_of(noisy)
    for level in (60.0, 200.0):
        assert abs((a + b * level) / (2.0 + 0.05 * level) - 1.0) < 0.05


@pytest.mark.parametrize("legacy", [False, True])
def test_a_charuco_board_may_be_cut_off(legacy: bool) -> None:
    board = Board("charuco", 8, 5, 0.025, 0.018, legacy=legacy)
    exact, truth = photograph(board, 0.1)
    noisy = exact + np.random.default_rng(3).normal(size=exact.shape)
    view, _ = detect(noisy[:, :320], board, "cut")
    assert 8 <= len(view.pixel) < len(board.target)
    number = np.rint(view.target / board.square).astype(int) @ [1, board.columns]
    np.testing.assert_allclose(view.pixel, truth[number], atol=0.15)


def test_what_is_no_such_board_is_told() -> None:
    exact, _ = photograph(CHECKERS, 0.0)
    with pytest.raises(InputError, match="no checkerboard of that size"):
        detect(exact, Board("checkerboard", 11, 7, 0.025), "wrong")
    with pytest.raises(InputError, match="no ChArUco board"):
        detect(exact, CHARUCO, "wrong")
    with pytest.raises(InputError, match="mirrored"):
        detect(photograph(CHARUCO, 0.0)[0][:, ::-1], CHARUCO, "mirrored")


def test_the_line_is_taken_between_the_edges_of_squares() -> None:
    _, truth = photograph(CHECKERS, 0.0)
    view, _ = detect(photograph(CHECKERS, 0.0)[0], CHECKERS, "image")
    middle = 0.25 * (truth[0] + truth[1] + truth[9] + truth[10])
    edge, off = 0.5 * (truth[0] + truth[9]) + [3.0, 0.0], truth[0] - 30.0
    np.testing.assert_array_equal(on_board(view, CHECKERS, np.array([middle, edge, off]), 5.0), [True, False, False])
    upper = 0.5 * (truth[0] + truth[1]) + [0.0, 3.0]
    np.testing.assert_array_equal(on_board(view, CHECKERS, np.array([edge, upper]), 5.0, "columns"), [True, False])


def test_noise_of_whole_numbers_is_told_where_a_board_fills_the_image() -> None:
    """A median of second differences alone is one of a few values there: it told 7 to 15 % too much."""
    random, side = np.random.default_rng(5), np.arange(600)
    board = np.where((side[:, None] // 60 + side[None] // 60) % 2 == 0, 60.0, 170.0)
    light = cv2.GaussianBlur(board, (0, 0), 0.8)
    image = np.rint(light + random.normal(size=light.shape) * np.sqrt(0.3 + 0.025 * light))
    offset, gain = noise_of(image)
    for level in (60.0, 170.0):
        assert offset + gain * level == pytest.approx(0.3 + 1.0 / 12.0 + 0.025 * level, rel=0.05)
