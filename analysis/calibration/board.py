"""Calibration boards: checkerboards, ChArUco boards and circle grids, and the places of their corners or centres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from render.base.arrays import Float


@dataclass(frozen=True)
class Board:
    """A flat board of squares, side in m; `columns` x `rows` are inner corners, where four squares meet.

    Origin at the first corner, x along its row. ChArUco boards carry markers of side `marker` in their white squares;
    `legacy` is the layout of OpenCV before 4.6, which differs where the number of rows of squares is even. Circle grids
    have dark discs of diameter `marker` in place of corners, `square` from centre to centre.
    """

    kind: Literal["checkerboard", "charuco", "circles"]
    columns: int
    rows: int
    square: float
    marker: float = 0.0
    dictionary: str = "DICT_5X5_250"
    legacy: bool = False

    @property
    def target(self) -> Float:
        """(columns rows, 2) m, row by row."""
        y, x = np.mgrid[0 : self.rows, 0 : self.columns]
        return np.stack([x.ravel(), y.ravel()], axis=1) * self.square

    @property
    def extent(self) -> Float:
        """(2, 2) m, first and last corner."""
        return np.array([[0.0, 0.0], [self.columns - 1.0, self.rows - 1.0]]) * self.square

    @property
    def circle(self) -> float:
        """m, radius of its discs; 0 where it has none."""
        return 0.5 * self.marker if self.kind == "circles" else 0.0

    @property
    def clear(self) -> float:
        """Share of a square's side about a corner in which there is nothing but the crossing of four squares."""
        return 0.4 if self.kind == "checkerboard" else min(0.4, 0.5 * (1.0 - self.marker / self.square))

    def charuco(self) -> Any:
        """The board as OpenCV has it, of squares in units of one."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        size = (self.columns + 1, self.rows + 1)
        board = cv2.aruco.CharucoBoard(size, 1.0, self.marker / self.square, dictionary)
        board.setLegacyPattern(self.legacy)
        return board
