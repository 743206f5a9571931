"""Items over the camera's image: corners, residuals as arrows, laser points, the ghost of a board, coverage."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainterPath, QPolygonF
from PySide6.QtWidgets import QGraphicsPathItem, QGraphicsRectItem

from analysis.report.colour import TRUTH
from render.base.arrays import Bool, Float

ARROW, LINE, GHOST, EMPTY = "#ff3d7f", "#2fbf71", "#ffb300", "#ffb300"
"""Over an image in grey, which is the same in every theme."""
SENSOR, PAPER, INK = "#4c535a", "#d5d9dc", "#2b3036"
"""Of a virtual board, which no photograph shows."""
HEAD = 0.3
"""Of an arrow's length: its head."""


class BoardItems:
    """Everything is cleared by `clear` and then shown piece by piece, in pixel coordinates."""

    def __init__(self, box: pg.ViewBox) -> None:
        self.sensor = QGraphicsRectItem()
        self.sensor.setBrush(QColor(SENSOR))
        self.sensor.setPen(pg.mkPen(None))
        self.paper, self.squares = _path(PAPER), _path(INK)
        self.empty, self.ghost = _path(EMPTY, 0.16), _path(GHOST, 0.45)
        self.edge = pg.PlotCurveItem(pen=pg.mkPen(GHOST, width=2.0))
        self.corners = pg.ScatterPlotItem(pen=None, brush=pg.mkBrush(TRUTH), size=4, pxMode=True)
        self.strays = pg.ScatterPlotItem(pen=pg.mkPen(ARROW, width=1.5), brush=None, symbol="x", size=9, pxMode=True)
        self.line = pg.ScatterPlotItem(pen=None, brush=pg.mkBrush(LINE), size=2.5, pxMode=True)
        self.arrows = pg.PlotCurveItem(pen=pg.mkPen(ARROW, width=1.8), connect="pairs")
        self.sensor.setFlag(QGraphicsRectItem.GraphicsItemFlag.ItemClipsChildrenToShape)
        self.paper.setParentItem(self.sensor)
        self.squares.setParentItem(self.sensor)
        shown = (self.empty, self.line, self.corners, self.strays, self.arrows, self.ghost, self.edge)
        for level, item in enumerate((self.sensor, *shown)):
            item.setZValue(level - 1)  # the photograph is at 0
            box.addItem(item, ignoreBounds=True)
        self.clear()

    def clear(self) -> None:
        """Nothing but the image."""
        self.sensor.setRect(QRectF())
        for shape in (self.paper, self.squares, self.empty, self.ghost):
            shape.setPath(QPainterPath())
        for curve in (self.edge, self.arrows):
            curve.setData([], [])
        for points in (self.corners, self.strays, self.line):
            points.setData([], [])

    def show_virtual(self, size: tuple[int, int], outline: Float, squares: Float) -> None:
        """A board in place of a photograph; outline (n, 2), squares (k, 4, 2) px."""
        self.show_sensor(size)
        self.paper.setPath(_polygons(outline[None]))
        self.squares.setPath(_polygons(squares))

    def show_sensor(self, size: tuple[int, int]) -> None:
        """An image without a picture."""
        self.sensor.setRect(QRectF(-0.5, -0.5, *(float(side) for side in size)))

    def show_corners(self, pixel: Float, counted: Bool) -> None:
        """(n, 2) px; strays are crossed out."""
        self.corners.setData(*pixel[counted].T)
        self.strays.setData(*pixel[~counted].T)

    def show_line(self, pixel: Float) -> None:
        """(m, 2) px of laser points."""
        self.line.setData(*pixel.T)

    def show_arrows(self, pixel: Float, off: Float, scale: float) -> None:
        """(n, 2) px from, (n, 2) px by, drawn `scale` times as long."""
        self.arrows.setData(*_arrows(pixel, off * scale).T)

    def show_ghost(self, outline: Float, squares: Float) -> None:
        """Where the board is to be held."""
        self.ghost.setPath(_polygons(squares))
        self.edge.setData(*outline.T, connect="finite")

    def show_empty(self, counts: Float, size: tuple[int, int]) -> None:
        """(rows, columns) of corners in parts of the image: those without any are tinted."""
        rows, columns = np.nonzero(counts == 0.0)
        step = np.array(size) / np.array(counts.shape[::-1])
        low = np.column_stack([columns, rows])
        cells = (low[:, None, :] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) * step - 0.5
        self.empty.setPath(_polygons(cells))


def _arrows(start: Float, by: Float) -> Float:
    """(6 n, 2) pairs of points: of each arrow its shaft and the two strokes of its head."""
    end = start + by
    back, side = -HEAD * by, 0.5 * HEAD * np.column_stack([-by[:, 1], by[:, 0]])
    return np.stack([start, end, end, end + back + side, end, end + back - side], axis=1).reshape(-1, 2)


def _path(colour: str, opacity: float = 1.0) -> QGraphicsPathItem:
    item = QGraphicsPathItem()
    filled = QColor(colour)
    filled.setAlphaF(opacity)
    item.setBrush(filled)
    item.setPen(pg.mkPen(None))
    return item


def _polygons(corners: Float) -> QPainterPath:
    """(k, n, 2) px."""
    path = QPainterPath()
    path.setFillRule(Qt.FillRule.WindingFill)
    for one in corners:
        finite = one[np.isfinite(one).all(axis=1)]
        path.addPolygon(QPolygonF([QPointF(*point) for point in finite.tolist()]))
        path.closeSubpath()
    return path
