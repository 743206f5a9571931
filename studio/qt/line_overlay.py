"""Lines over an image: the true one, and the one that each method extracted; each is switched by its own box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtGui import QColor, QIcon, QPixmap
from PySide6.QtWidgets import QCheckBox

from analysis.line.result import Line
from analysis.report.colour import TRUTH, method_colour, method_name
from render.frame import LaserCurve
from studio.qt import theme
from studio.results import METHODS

Float = NDArray[np.float64]
SYMBOLS_FROM = 6.0
"""Screen pixels a pixel from which single positions are marked."""
JUMP_PX = 4.0
"""Positions of neighbouring scan lines that are further apart are not joined."""
SHORT = {"likelihood": "Likelihood", "gaussian": "Gaussian", "centre_of_mass": "Centre of mass"}


def swatch(colour: str, size: int = 10) -> QIcon:
    """A square of one colour."""
    pixmap = QPixmap(size, size)
    pixmap.fill(QColor(colour))
    icon = QIcon(pixmap)
    icon.addPixmap(pixmap, QIcon.Mode.Disabled)  # a colour is information, also where nothing can be clicked
    return icon


class LineOverlay:
    """Items in a view box, in pixel coordinates; `boxes` are for a toolbar."""

    def __init__(self, box: pg.ViewBox) -> None:
        self.box = box
        self.truth = self._item(TRUTH, 2.0, 10, 13)
        self.methods = {
            method: self._item(method_colour(method), 1.2, 11 + i, 7 + 2 * i) for i, method in enumerate(METHODS)
        }
        self.hover = pg.InfiniteLine(angle=0, pen=pg.mkPen(theme.colours().accent, width=1))
        self.hover.setZValue(9)
        self.hover.hide()
        box.addItem(self.hover, ignoreBounds=True)
        self.truth_box = self._box("True line", TRUTH, "The exact line", True)
        self.method_boxes = {
            method: self._box(SHORT[method], method_colour(method), f"Extracted by {method_name(method)}", i == 0)
            for i, method in enumerate(METHODS)
        }
        self.boxes = [self.truth_box, *self.method_boxes.values()]
        box.sigRangeChanged.connect(lambda *changed: self._zoomed())
        self._switch()

    def show_truth(self, curves: Sequence[LaserCurve]) -> None:
        parts = [_joined(curve.axis, curve.index.astype(np.float64), curve.position) for curve in curves]
        self._set(self.truth, parts)

    def show_methods(self, lines: Sequence[Line]) -> None:
        """The lines of all methods and lasers; a method without one is cleared."""
        for method, item in self.methods.items():
            parts = []
            for line in lines:
                if line.method == method:
                    for rank in range(line.u.shape[1]):
                        index = np.flatnonzero(line.valid[:, rank])
                        parts.append(_joined(line.axis, index.astype(np.float64), line.u[index, rank]))
            self._set(item, parts)

    def show_hover(self, index: int | None, axis: str) -> None:
        """Mark a scan line; None: none."""
        self.hover.setVisible(index is not None)
        if index is not None:
            self.hover.setAngle(0 if axis == "rows" else 90)
            self.hover.setPen(pg.mkPen(theme.colours().accent, width=1))
            self.hover.setValue(float(index))

    def _item(self, colour: str, width: float, z: float, size: int) -> pg.PlotDataItem:
        pens = {"pen": pg.mkPen(colour, width=width), "symbolPen": pg.mkPen(colour, width=1.5)}
        item = pg.PlotDataItem(**pens, symbolBrush=pg.mkBrush(None), symbolSize=size)
        item.setZValue(z)
        self.box.addItem(item, ignoreBounds=True)
        return item

    def _box(self, text: str, colour: str, tip: str, on: bool) -> QCheckBox:
        box = QCheckBox(text)
        box.setIcon(swatch(colour))
        box.setToolTip(tip)
        box.setChecked(on)
        box.toggled.connect(lambda checked: self._switch())
        return box

    def _switch(self) -> None:
        self.truth.setVisible(self.truth_box.isChecked())
        for method, box in self.method_boxes.items():
            self.methods[method].setVisible(box.isChecked())

    def _set(self, item: pg.PlotDataItem, parts: list[tuple[Float, Float, NDArray[np.int32]]]) -> None:
        if not parts:
            item.setData([], [])
            return
        x, y, connect = (np.concatenate([part[k] for part in parts]) for k in range(3))
        item.setData(x, y, connect=connect)

    def _zoomed(self) -> None:
        width = self.box.viewRect().width()
        near = width > 0 and self.box.width() / width >= SYMBOLS_FROM
        for item, symbol in ((self.truth, "+"), *((item, "o") for item in self.methods.values())):
            wanted = symbol if near else None
            if item.opts["symbol"] != wanted:
                item.setSymbol(wanted)


def _joined(axis: str, index: Float, position: Float) -> tuple[Float, Float, NDArray[np.int32]]:
    """x, y and which points are joined to the next: the same branch on the next scan line."""
    connect = np.zeros(len(index), np.int32)
    if len(index) > 1:
        connect[:-1] = (np.diff(index) == 1.0) & (np.abs(np.diff(position)) < JUMP_PX)
    return (position, index, connect) if axis == "rows" else (index, position, connect)
