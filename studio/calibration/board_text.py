"""A board as a person types it: "checkerboard:13x9:25mm:marker", "charuco:14x10:25mm:18mm:DICT_5X5_250:legacy",
"circles:13x9:25mm:12mm"."""

from __future__ import annotations

import re

from analysis.calibration.board import Board
from render.base.errors import InputError

FORM = (
    "checkerboard:COLUMNSxROWS:SIDE[:marker] with inner corners, as checkerboard:13x9:25mm, or "
    "charuco:COLUMNSxROWS:SIDE:MARKER[:DICTIONARY][:legacy] with squares, as charuco:14x10:25mm:18mm, or "
    "circles:COLUMNSxROWS:SPACING:DIAMETER with dark discs, as circles:13x9:25mm:12mm"
)
UNITS = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
WIDEST_DISC = 0.6
"""Of the spacing: about each disc the paper's brightness is to be seen."""
FEWEST_ABOUT_MARKER = 4
"""Corners a side of a board with a marker in its middle."""
MOST = 200
"""Corners a side."""


def parse_board(text: str) -> Board:
    """The board. InputError: not of the form, or a size that no board has."""
    kind, *parts = text.split(":")
    counts = re.fullmatch(r"(\d{1,4})x(\d{1,4})", parts[0]) if parts else None
    if (
        kind not in ("checkerboard", "charuco", "circles")
        or counts is None
        or len(parts) < (2 if kind == "checkerboard" else 3)
    ):
        raise _refused(text)
    columns, rows = int(counts[1]), int(counts[2])
    square = _length(parts[1], text)
    if kind == "checkerboard":
        dotted = parts[2:] == ["marker"]
        if (len(parts) > 2 and not dotted) or (dotted and min(columns, rows) < FEWEST_ABOUT_MARKER):
            raise _refused(text)
        board = Board("checkerboard", columns, rows, square, dotted=dotted)
    elif kind == "circles":
        diameter = _length(parts[2], text)
        if len(parts) > 3 or not 0.1 * square <= diameter <= WIDEST_DISC * square:
            raise _refused(text)
        board = Board("circles", columns, rows, square, diameter)
    else:
        marker, rest = _length(parts[2], text), parts[3:]
        legacy = "legacy" in rest
        names = [one for one in rest if one != "legacy"]
        if len(names) > 1 or not 0.0 < marker < square:
            raise _refused(text)
        dictionary = names[0] if names else "DICT_5X5_250"
        _check_dictionary(dictionary, (columns * rows) // 2)
        board = Board("charuco", columns - 1, rows - 1, square, marker, dictionary, legacy)
    if min(board.columns, board.rows) < 2 or max(board.columns, board.rows) > MOST:
        raise _refused(text)
    return board


def board_text(board: Board) -> str:
    """The text that `parse_board` reads."""
    side = f"{1e3 * board.square:.9g}mm"
    if board.kind == "checkerboard":
        return f"checkerboard:{board.columns}x{board.rows}:{side}{':marker' if board.dotted else ''}"
    if board.kind == "circles":
        return f"circles:{board.columns}x{board.rows}:{side}:{1e3 * board.marker:.9g}mm"
    legacy = ":legacy" if board.legacy else ""
    marker = f"{1e3 * board.marker:.9g}mm"
    return f"charuco:{board.columns + 1}x{board.rows + 1}:{side}:{marker}:{board.dictionary}{legacy}"


def _length(text: str, whole: str) -> float:
    found = re.fullmatch(r"(\d+(?:\.\d*)?|\.\d+)(um|mm|cm|m|in)", text)
    if found is None or not 1e-5 <= float(found[1]) * UNITS[found[2]] <= 10.0:
        raise _refused(whole)
    return float(found[1]) * UNITS[found[2]]


def _check_dictionary(name: str, markers: int) -> None:
    import cv2

    names = [one for one in dir(cv2.aruco) if one.startswith("DICT_")]
    if name not in names:
        raise InputError("there is no such dictionary", where="--board", found=name, allowed=", ".join(names))
    held = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name)).bytesList)
    if markers > held:
        raise InputError(
            "the dictionary has too few markers for the board", where="--board", found=f"{held} for {markers}"
        )


def _refused(text: str) -> InputError:
    return InputError("not a board", where="--board", found=text, allowed=FORM)
