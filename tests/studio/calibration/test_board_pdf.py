"""Boards to print: the PDF has the board's size, and what is drawn is the board that the detector looks for."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from analysis.calibration.detect import detect
from render.base.errors import InputError
from studio.calibration.board_pdf import PAPERS, dark_squares, write_board
from studio.calibration.board_text import board_text, parse_board

BOARDS = [
    "checkerboard:13x9:25mm",
    "checkerboard:13x9:25mm:marker",
    "charuco:14x10:25mm:18mm",
    "charuco:7x6:0.03m:20mm:DICT_4X4_50:legacy",
]


@pytest.mark.parametrize("text", BOARDS)
def test_what_is_drawn_is_what_is_detected(text: str) -> None:
    board = parse_board(text)
    scale = 1600.0  # px/m
    size = [int(round((n + 3) * board.square * scale)) for n in (board.rows, board.columns)]
    image = np.full(size, 220.0)
    y, x = ((np.arange(n) + 0.5) / scale - board.square for n in size)
    for left, top, side in dark_squares(board):
        image[np.ix_((y > top) & (y < top + side), (x > left) & (x < left + side))] = 40.0
    view, _ = detect(image + np.random.default_rng(0).normal(size=image.shape), board, text)
    assert len(view.pixel) == len(board.target)
    # corners one square apart on the board are so in the image, and none is mistaken for another
    expected = (view.target + 2.0 * board.square) * scale - 0.5
    flipped = (board.extent[1] - view.target + 2.0 * board.square) * scale - 0.5
    best = min(np.abs(view.pixel - expected).max(), np.abs(view.pixel - flipped).max())
    assert best < 0.75


def test_a_grid_of_discs_is_printed_to_scale(tmp_path: Path) -> None:
    import zlib

    path = tmp_path / "board.pdf"
    assert write_board(path, parse_board("circles:5x4:30mm:12mm"), None) == "A4"
    page = b"".join(zlib.decompress(one) for one in re.findall(rb"stream\r?\n(.*?)endstream", path.read_bytes(), re.S))
    curves = re.findall(rb"([\d.]+) ([\d.]+) m\n((?:[\d. ]+ c\n){8})", page)
    points = [np.array([line.split()[4:6] for line in one[2].splitlines()], dtype=float) for one in curves]
    points = [each for each in points if 30.0 < np.ptp(each[:, 0]) < 40.0]  # letters are in units of their own
    assert len(points) == 20
    centres, widths = np.array([each.mean(axis=0) for each in points]), [np.ptp(each, axis=0) for each in points]
    np.testing.assert_allclose(widths, 12.0 / 25.4 * 72.0, rtol=1e-4)
    np.testing.assert_allclose(np.ptp(centres, axis=0), np.array([120.0, 90.0]) / 25.4 * 72.0, rtol=1e-4)


@pytest.mark.parametrize("text", ["circles:5x4:30mm", "circles:5x4:30mm:19mm", "circles:5x4:30mm:12mm:legacy"])
def test_discs_without_paper_about_them_are_no_grid(text: str) -> None:
    with pytest.raises(InputError, match="not a board"):
        parse_board(text)


def test_the_page_is_to_scale(tmp_path: Path) -> None:
    path = tmp_path / "board.pdf"
    assert write_board(path, parse_board("checkerboard:13x9:25mm"), None) == "A3"
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", path.read_bytes())
    assert box is not None
    found = [float(side) / 72.0 * 0.0254 for side in box.groups()]
    np.testing.assert_allclose(found, PAPERS["A3"], atol=1e-5)
    with pytest.raises(InputError, match="does not fit"):
        write_board(path, parse_board("checkerboard:13x9:25mm"), "A4")
    with pytest.raises(InputError, match="fits on no paper"):
        write_board(path, parse_board("checkerboard:13x9:25cm"), None)


@pytest.mark.parametrize("text", BOARDS)
def test_a_board_is_the_same_after_it_was_told(text: str) -> None:
    assert parse_board(board_text(parse_board(text))) == parse_board(text)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "chess:3x3:1mm",
        "checkerboard:13x9",
        "checkerboard:13x9:25",
        "checkerboard:1x9:25mm",
        "charuco:14x10:25mm:30mm",
        "charuco:14x10:25mm:18mm:DICT_NONE",
        "charuco:40x40:25mm:18mm:DICT_4X4_50",
    ],
)
def test_what_is_no_board_is_told(text: str) -> None:
    with pytest.raises(InputError, match="--board"):
        parse_board(text)
