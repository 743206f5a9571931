"""Calibration boards: checkerboards, ChArUco boards and circle grids, and the places of their corners or centres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from render.base.arrays import Float

DOT = 0.17
"""Radius of a marker's dot, in squares: OpenCV's."""
ELL = np.array([[0, -1], [0, 0], [1, 0]])
"""A marker's squares: an end, the bend, the other end."""


@dataclass(frozen=True)
class Board:
    """A flat board of squares, side in m; `columns` x `rows` are inner corners, where four squares meet.

    Origin at the first corner, x along its row. ChArUco boards carry markers of side `marker` in their white squares;
    `legacy` is the layout of OpenCV before 4.6, which differs where the number of rows of squares is even. Circle grids
    have dark discs of diameter `marker` in place of corners, `square` from centre to centre. A checkerboard may have a
    marker in its middle, three dots in an L, by which it is known though it is cut off.
    """

    kind: Literal["checkerboard", "charuco", "circles"]
    columns: int
    rows: int
    square: float
    marker: float = 0.0
    dictionary: str = "DICT_5X5_250"
    legacy: bool = False
    dotted: bool = False

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
    def dots(self) -> NDArray[np.intp]:
        """(3, 2) column and row of the squares that have a dot of the other colour, in the L's order; or (0, 2).

        Squares are counted from the dark one before the first corner.
        """
        if not self.dotted:
            return np.empty((0, 2), dtype=np.intp)
        return np.array([self.columns // 2, (self.rows + 1) // 2]) + ELL

    @property
    def discs(self) -> tuple[Float, float]:
        """(k, 2) m, centres of all discs and dots, and m, their radius."""
        if self.kind == "circles":
            return self.target, self.circle
        return np.asarray((self.dots - 0.5) * self.square), DOT * self.square

    @property
    def clear(self) -> float:
        """Share of a square's side about a corner in which there is nothing but the crossing of four squares."""
        if self.kind == "checkerboard":
            # a window's corner is to keep off the dot in a square's middle
            return np.sqrt(0.5) * (np.sqrt(0.5) - DOT) if self.dotted else 0.4
        return min(0.4, 0.5 * (1.0 - self.marker / self.square))

    def charuco(self) -> Any:
        """The board as OpenCV has it, of squares in units of one."""
        import cv2

        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, self.dictionary))
        size = (self.columns + 1, self.rows + 1)
        board = cv2.aruco.CharucoBoard(size, 1.0, self.marker / self.square, dictionary)
        board.setLegacyPattern(self.legacy)
        return board
