"""A field that a recipe draws, and its range: dragged with two handles or typed."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget
from superqt import QRangeSlider

from studio.dataset.field_names import value_name
from studio.dataset.recipe import Draw
from studio.editing.forms import PLAIN
from studio.editing.units import Unit
from studio.project.project import Project
from studio.qt.core.boxes import StillBox
from studio.qt.core.icons import icon_button
from studio.qt.core.widgets import ElidedLabel
from studio.qt.forms.unit_box import UnitBox

RANGED = ("uniform", "logarithmic", "normal", "integer")
STEPS = 1000
"""Of the slider."""
BOX_WIDTH = 112
"""px."""
MOST_SAID = 30
"""Of the values of a choice."""
ROOM = 0.5
"""How far beyond the file's range the slider reaches on either side, in parts of it."""


class RangeSlider(StillBox, QRangeSlider):  # type: ignore[misc]
    """Two ends on one line."""


class DrawRow(QWidget):
    """The slider spans the range that the recipe's file has, and half of it on either side."""

    chosen = Signal(float, float)
    removed = Signal()
    refused = Signal(str)
    """Why what was typed is not taken over."""

    def __init__(self, draw: Draw, label: str, unit: Unit = PLAIN, base: Project | None = None) -> None:
        """base: the project that has the field; None: it cannot be read."""
        super().__init__()
        self.draw, self.unit = draw, unit
        self.name = ElidedLabel(Qt.TextElideMode.ElideLeft)
        self.name.setText(label)
        self.name.setToolTip(f"{draw.field}, {draw.kind}")
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 2, 0, 2)
        layout.setColumnStretch(1, 1)
        self.remove = icon_button("cancel", f"No longer draw {label}", self.removed.emit)
        layout.addWidget(self.name, 0, 0, 1, 2)
        layout.addWidget(self.remove, 0, 2, Qt.AlignmentFlag.AlignRight)
        self.boxes: tuple[UnitBox, ...] = ()
        if draw.kind not in RANGED or draw.low is None or draw.high is None:
            told = QLabel(said(draw, unit, base), wordWrap=True)
            told.setObjectName("muted")
            layout.addWidget(told, 1, 0, 1, 3)
            return
        self.logarithmic = draw.kind == "logarithmic"
        low, high = self._scaled(draw.low), self._scaled(draw.high)
        self.least, self.most = low - ROOM * (high - low), high + ROOM * (high - low)
        self.slider = RangeSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, STEPS)
        self.slider.setAccessibleName(f"Range of {self.name.text()}")
        self.boxes = (self._box(draw.low), self._box(draw.high))
        layout.addWidget(self.boxes[0], 1, 0)
        layout.addWidget(self.slider, 1, 1)
        layout.addWidget(self.boxes[1], 1, 2)
        self._show(draw.low, draw.high)
        self.slider.valueChanged.connect(self._take_slider)
        self.slider.sliderReleased.connect(self._tell)
        for box in self.boxes:
            box.editingFinished.connect(self._take_boxes)

    def follow(self, draw: Draw) -> None:
        """Show the range that the recipe has now."""
        self.draw = draw
        if self.boxes and draw.low is not None and draw.high is not None:
            self._show(draw.low, draw.high)

    def _show(self, low: float, high: float) -> None:
        for box, value in zip(self.boxes, (low, high), strict=True):
            self._put(box, value)
        self.slider.blockSignals(True)
        places = [(self._scaled(value) - self.least) / (self.most - self.least) for value in (low, high)]
        self.slider.setValue([min(max(round(STEPS * place), 0), STEPS) for place in places])
        self.slider.blockSignals(False)

    def _box(self, value: float) -> UnitBox:
        whole = self.draw.kind == "integer"
        span = (self.draw.high or 0.0) - (self.draw.low or 0.0)
        smallest = (abs(self.draw.low or span) if self.logarithmic else span) * self.unit.factor
        decimals = 0 if whole else max(0, min(9, 2 - math.floor(math.log10(smallest))))
        box = UnitBox(self.unit, -1e9, 1e9, decimals)
        box.setAccessibleName(self.name.text())
        box.refused.connect(self.refused)
        box.setSingleStep(1.0 if whole else 10.0 ** (1 - decimals))
        box.setFixedWidth(BOX_WIDTH)
        self._put(box, value)
        return box

    def _put(self, box: UnitBox, value: float) -> None:
        box.blockSignals(True)
        box.setValue(value * self.unit.factor)
        box.blockSignals(False)

    def _range(self) -> tuple[float, float]:
        """As shown; an end that nobody moved keeps the digits that are not."""
        ends = []
        for box, before in zip(self.boxes, (self.draw.low, self.draw.high), strict=True):
            kept = before is not None and round(before * self.unit.factor, box.decimals()) == box.value()
            ends.append(before if kept and before is not None else float(f"{box.value() / self.unit.factor:.9g}"))
        return ends[0], ends[1]

    def _take_slider(self, places: tuple[int, int]) -> None:
        values = [self._unscaled(self.least + place / STEPS * (self.most - self.least)) for place in places]
        for box, value in zip(self.boxes, values, strict=True):
            self._put(box, value)
        if not self.slider.isSliderDown():
            self._tell()

    def _take_boxes(self) -> None:
        low, high = self._range()
        if low < high:
            self._show(low, high)
        self._tell()

    def _tell(self) -> None:
        self.chosen.emit(*self._range())

    def _scaled(self, value: float) -> float:
        return math.log(max(value, 1e-300)) if self.logarithmic else value

    def _unscaled(self, value: float) -> float:
        return math.exp(value) if self.logarithmic else round(value) if self.draw.kind == "integer" else value


def said(draw: Draw, unit: Unit, base: Project | None) -> str:
    """What is drawn of a field without a range."""
    if draw.kind == "mesh":
        return f"a mesh of {draw.folder}"
    # alike ones in a row are likelier, not others
    values = list(dict.fromkeys(value_name(base, draw.field, value, unit) for value in draw.values[:MOST_SAID]))
    more = len(draw.values) - MOST_SAID
    between = "; " if any("," in value for value in values) else ", "
    return "one of " + between.join(values) + (f" and {more} more" if more > 0 else "")
