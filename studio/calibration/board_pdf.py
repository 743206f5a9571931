"""A board as a PDF to scale, with a ruler beside it that tells whether the printer kept to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.calibration.board import Board
from render.base.errors import InputError
from render.base.files import atomic_write
from studio.calibration.board_text import board_text

PAPERS = {"A4": (0.297, 0.210), "A3": (0.420, 0.297), "A2": (0.594, 0.420), "A1": (0.841, 0.594), "A0": (1.189, 0.841)}
"""m, landscape."""
MARGIN, RULER = 0.010, 0.016
"""m: around the board, and below it for the ruler and its words."""


def write_board(path: Path, board: Board, paper: str | None, contrast: float = 1.0) -> str:
    """Write the PDF; returns the paper that was taken. contrast: 1 black on white; less is grey on white.

    A dark grey in place of black lets the laser's line be seen on every square.
    InputError: the board does not fit on the paper, or on any.
    """
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle, Rectangle

    size = ((board.columns + 1) * board.square, (board.rows + 1) * board.square)
    taken = _paper(size, paper)
    width, height = PAPERS[taken]
    figure = Figure(figsize=(width / 0.0254, height / 0.0254))
    FigureCanvasPdf(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    axes.axis("off")
    left, bottom = 0.5 * (width - size[0]), RULER + 0.5 * (height - RULER - size[1])
    ink = str(1.0 - contrast)
    for x, y in board.target if board.kind == "circles" else ():
        middle = (left + board.square + x, bottom + size[1] - board.square - y)
        axes.add_patch(Circle(middle, board.circle, facecolor=ink, edgecolor="none", linewidth=0.0))
    for x, y, side in dark_squares(board):
        # pages count upwards from the bottom, boards downwards from the top
        corner = (left + x, bottom + size[1] - y - side)
        axes.add_patch(Rectangle(corner, side, side, facecolor=ink, edgecolor="none", linewidth=0.0))
    centres, radius = board.discs if board.dotted else (np.empty((0, 2)), 0.0)
    for (x, y), cell in zip(centres, board.dots, strict=True):
        middle = (left + board.square + x, bottom + size[1] - board.square - y)
        colour = "1.0" if cell.sum() % 2 == 0 else ink
        axes.add_patch(Circle(middle, radius, facecolor=colour, edgecolor="none", linewidth=0.0))
    _ruler(axes, left, size[0])
    words = f"{board_text(board)}   print at 100 %; the ruler must be right, or the scale is wrong   Blazer Studio"
    axes.text(left, 0.0035, words, fontsize=7, color="0.25", family="DejaVu Sans")
    with atomic_write(path) as temporary:
        figure.savefig(temporary, format="pdf", metadata={"Title": board_text(board), "CreationDate": None})
    return taken


def dark_squares(board: Board) -> list[tuple[float, float, float]]:
    """x, y of the upper left corner and side, m, from the board's upper left, of all dark squares."""
    if board.kind == "circles":
        return []
    if board.kind == "checkerboard":
        cells = [(x, y) for y in range(board.rows + 1) for x in range(board.columns + 1) if (x + y) % 2 == 0]
        return [(x * board.square, y * board.square, board.square) for x, y in cells]
    # as OpenCV draws it, at so many pixels a square that every marker's cell has a whole number of them
    bits = _marker_cells(board)
    fine = 20 * bits
    image = board.charuco().generateImage(((board.columns + 1) * fine, (board.rows + 1) * fine))
    dark = []
    for y in range(board.rows + 1):
        for x in range(board.columns + 1):
            square = image[y * fine : (y + 1) * fine, x * fine : (x + 1) * fine]
            if not square.any():
                dark.append((x * board.square, y * board.square, board.square))
                continue
            dark += _marker(square, board, bits, (x * board.square, y * board.square))
    return dark


def _marker_cells(board: Board) -> int:
    import cv2

    return int(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).markerSize) + 2


def _marker(square: np.ndarray, board: Board, bits: int, at: tuple[float, float]) -> list[tuple[float, float, float]]:
    start, side = 0.5 * (board.square - board.marker), board.marker / bits
    dark = []
    for row in range(bits):
        for column in range(bits):
            x, y = (start + (column + 0.5) * side), (start + (row + 0.5) * side)
            pixel = [int(value / board.square * len(square)) for value in (y, x)]
            if square[pixel[0], pixel[1]] < 128:
                dark.append((at[0] + start + column * side, at[1] + start + row * side, side))
    return dark


def _paper(size: tuple[float, float], asked: str | None) -> str:
    fits = [
        name
        for name, (width, height) in PAPERS.items()
        if size[0] + 2 * MARGIN <= width and size[1] + 2 * MARGIN + RULER <= height
    ]
    found = f"{1e3 * size[0]:.0f} x {1e3 * size[1]:.0f} mm"
    if asked is not None and asked not in fits:
        cure = f"--paper {fits[0]}, or smaller squares" if fits else "smaller squares"
        raise InputError("the board does not fit on the paper", where="--paper", found=found, allowed=asked, cure=cure)
    if not fits:
        raise InputError("the board fits on no paper", where="--board", found=found, allowed="A0 with a margin")
    return asked or fits[0]


def _ruler(axes: object, left: float, length: float) -> None:
    from matplotlib.axes import Axes

    assert isinstance(axes, Axes)
    whole = int(length / 0.010 + 1e-9)
    base = 0.010
    axes.plot([left, left + whole * 0.010], [base, base], color="0.0", linewidth=0.6)
    for tick in range(whole + 1):
        x = left + tick * 0.010
        tall = 0.003 if tick % 5 == 0 else 0.0018
        axes.plot([x, x], [base, base + tall], color="0.0", linewidth=0.6)
        if tick % 5 == 0:
            axes.text(x + 0.0006, base + 0.0012, f"{tick * 10} mm", fontsize=6, color="0.25", family="DejaVu Sans")
