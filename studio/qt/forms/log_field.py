"""A positive number as a logarithmic slider beside a box to type into."""

from __future__ import annotations

import math

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QWidget

from studio.editing.units import Unit
from studio.qt.core.boxes import Slider
from studio.qt.forms.unit_box import UnitBox

STEPS = 1000
"""Of the slider."""


class LogField(QWidget):
    """A positive number as a logarithmic slider and a box, in the unit that is shown; `shown = value * factor`."""

    changed = Signal(float, bool)
    """The value, and whether the slider is held."""
    released = Signal()
    refused = Signal(str)
    """Why what was typed is not taken over."""

    def __init__(self, low: float, high: float, factor: float, unit: str, decimals: int = 3) -> None:
        super().__init__()
        self.low, self.high, self.factor = low, high, factor
        self.slider = Slider(Qt.Orientation.Horizontal)
        self.slider.setMaximum(STEPS)
        self.slider.setMinimumWidth(60)
        self.box = UnitBox(Unit.named(unit), 0.0, high * factor, decimals)
        self.box.setStepType(UnitBox.StepType.AdaptiveDecimalStepType)
        self.box.setMinimumWidth(104)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.sign = QLabel()
        layout.addWidget(self.sign)
        layout.addWidget(self.slider, 1)
        layout.addWidget(self.box)
        self.slider.valueChanged.connect(self._slid)
        self.slider.sliderReleased.connect(self.released)
        self.box.refused.connect(self.refused)
        self.box.valueChanged.connect(lambda shown: self.changed.emit(shown / self.factor, False))

    def set_value(self, value: float) -> None:
        """Show a value without telling."""
        for widget in (self.slider, self.box):
            widget.blockSignals(True)
        if not self.slider.isSliderDown():
            share = math.log(min(max(value, self.low), self.high) / self.low) / math.log(self.high / self.low)
            self.slider.setValue(round(STEPS * share))
        self.box.setValue(value * self.factor)
        for widget in (self.slider, self.box):
            widget.blockSignals(False)

    def _slid(self, position: int) -> None:
        value = self.low * (self.high / self.low) ** (position / STEPS)
        # three digits: a slider's value looks like one a person would type
        self.changed.emit(float(f"{value:.3g}"), self.slider.isSliderDown())
