"""Lines over an image: the true one, and the one of each method that measured; each is switched by its own box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF
from PySide6.QtGui import QColor, QIcon, QPainter, QPen, QPixmap
from PySide6.QtWidgets import QCheckBox, QHBoxLayout

from analysis.line.result import Line
from analysis.report.colour import TRUTH, method_colour, method_name
from render.base.arrays import Float
from render.frame import LaserCurve

SYMBOLS_FROM = 6.0
"""Screen pixels a pixel from which single positions are marked."""
BOX_PX = 52
"""Of a box besides its name: mark, colour and the space to the next."""
JUMP_PX = 4.0
"""Positions of neighbouring scan lines that are further apart are not joined."""


def swatch(colour: str, size: int = 10) -> QIcon:
    """A square of one colour."""
    pixmap = QPixmap(size, size)
    pixmap.fill(QColor(colour))
    icon = QIcon(pixmap)
    icon.addPixmap(pixmap, QIcon.Mode.Disabled)  # a colour is information, also where nothing can be clicked
    return icon


def ticked_swatch(colour: str, size: int = 16) -> QIcon:
    """The same for a menu, which shows an icon in place of its tick: with a tick in it where the action is checked."""
    icon = swatch(colour, size)
    pixmap = QPixmap(size, size)
    pixmap.fill(QColor(colour))
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor("white"), 0.15 * size))
    painter.drawPolyline([QPointF(x * size, y * size) for x, y in ((0.2, 0.5), (0.42, 0.74), (0.82, 0.26))])
    painter.end()
    icon.addPixmap(pixmap, QIcon.Mode.Normal, QIcon.State.On)
    icon.addPixmap(pixmap, QIcon.Mode.Active, QIcon.State.On)
    return icon


class LineOverlay:
    """Items in a view box, in pixel coordinates; `bar` holds a box for each line. The first method starts visible."""

    def __init__(self, box: pg.ViewBox) -> None:
        self.box = box
        self._named = True
        self.bar = QHBoxLayout()
        self.bar.setSpacing(8)
        self.truth = self._item(TRUTH, 2.0, 10, 13)
        self.methods: dict[str, pg.PlotDataItem] = {}
        self.method_boxes: dict[str, QCheckBox] = {}
        self.truth_box = self._box("true line", TRUTH, "The exact line", True)
        box.sigRangeChanged.connect(lambda *changed: self._zoomed())
        self._switch()

    def show_truth(self, curves: Sequence[LaserCurve]) -> None:
        parts = [_joined(curve.axis, curve.index.astype(np.float64), curve.position) for curve in curves]
        self._set(self.truth, parts)

    def show_methods(self, lines: Sequence[Line]) -> None:
        """The lines of all methods and lasers; a method without one is cleared, its box hidden."""
        by_method: dict[str, list[Line]] = {}
        for line in lines:
            by_method.setdefault(line.method, []).append(line)
        for method in by_method:
            if method not in self.methods:
                self._add_method(method)
        for method, item in self.methods.items():
            self.method_boxes[method].setVisible(method in by_method)
            parts = []
            for line in by_method.get(method, []):
                for rank in range(line.u.shape[1]):
                    index = np.flatnonzero(line.valid[:, rank])
                    parts.append(_joined(line.axis, index.astype(np.float64), line.u[index, rank]))
            self._set(item, parts)

    def _add_method(self, method: str) -> None:
        first, colour, count = not self.methods, method_colour(method), len(self.methods)
        self.methods[method] = self._item(colour, 1.2, 11 + count, 7 + 2 * min(count, 4))
        name = method_name(method)
        self.method_boxes[method] = self._box(name, colour, f"The line extracted by {name}", first)
        self._switch()
        self._zoomed()

    def width_named(self) -> int:
        """px that the boxes take with their names."""
        metrics = self.truth_box.fontMetrics()
        shown = [box for box in (self.truth_box, *self.method_boxes.values()) if not box.isHidden()]
        return sum(BOX_PX + metrics.horizontalAdvance(box.property("name")) for box in shown)

    def width_within(self, width: int) -> int:
        """px that the boxes take: with their names where there is room for all, else with their colours alone."""
        count = sum(not box.isHidden() for box in (self.truth_box, *self.method_boxes.values()))
        return self.width_named() if self.width_named() <= width else BOX_PX * count

    def show_names_within(self, width: int) -> None:
        boxes = (self.truth_box, *self.method_boxes.values())
        self._named = self.width_within(width) > BOX_PX * sum(not box.isHidden() for box in boxes)
        for box in boxes:
            box.setText(str(box.property("name")) if self._named else "")

    def _item(self, colour: str, width: float, z: float, size: int) -> pg.PlotDataItem:
        pens = {"pen": pg.mkPen(colour, width=width), "symbolPen": pg.mkPen(colour, width=1.5)}
        item = pg.PlotDataItem(**pens, symbolBrush=pg.mkBrush(None), symbolSize=size)
        item.setZValue(z)
        self.box.addItem(item, ignoreBounds=True)
        return item

    def _box(self, text: str, colour: str, tip: str, on: bool) -> QCheckBox:
        box = QCheckBox(text if self._named else "")
        box.setProperty("name", text)
        box.setIcon(swatch(colour))
        box.setToolTip(tip)
        box.setChecked(on)
        box.toggled.connect(lambda checked: self._switch())
        self.bar.insertWidget(self.bar.count() - (self.bar.count() > 1), box)
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
