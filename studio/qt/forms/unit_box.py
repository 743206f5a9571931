"""A number with its unit and arrows to step it, for what is asked beside the project's own fields."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QPaintEvent, QValidator
from PySide6.QtWidgets import QLabel

from render.base.errors import InputError
from studio.editing.units import Unit
from studio.qt.core.boxes import DecimalBox
from studio.qt.forms.fields import outline, reason


class UnitBox(DecimalBox):
    """Its value is in the unit that is shown; other units and sums are taken as in `NumberField`.

    A value is entered by Return or by leaving; what will not do is outlined, and told by `refused`.
    """

    refused = Signal(str)
    """Why what was typed is not taken over."""

    def __init__(self, unit: Unit, low: float, high: float, decimals: int = 3, **properties: Any) -> None:
        self.unit = unit
        super().__init__(decimals=decimals, minimum=low, maximum=high, **properties)
        self.setSuffix(unit.shown if unit.shown == "°" else f" {unit.shown}".rstrip())
        self.setKeyboardTracking(False)
        self._beside = QLabel(unit.shown, self.lineEdit())
        self._beside.setObjectName("muted")
        self._beside.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.lineEdit().textChanged.connect(lambda _: self.update())

    @property
    def problem(self) -> str:
        """Why what is typed will not do; empty: it will."""
        try:
            self._read(self.text())
        except InputError as error:
            return reason(error)
        return ""

    def leave(self) -> None:
        """Take over what was typed, as something else is done now; what will not do is dropped, and told."""
        problem = self.problem
        self.interpretText()
        if problem:
            self._refuse(f"{problem}. The value is as it was")

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """All may be typed; what it is worth is told at its end."""
        try:
            self._read(text)
        except InputError:
            return QValidator.State.Intermediate, text, position
        return QValidator.State.Acceptable, text, position

    def valueFromText(self, text: str) -> float:
        return self._read(text)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.problem:
            self._refuse(self.problem)
            return
        super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        self.leave()
        super().focusOutEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        self._show_unit()  # here, as Qt tells nobody of a text that it sets itself
        if self.problem:
            outline(self)

    def _show_unit(self) -> None:
        """Beside a word that stands for no number, where it has room: what is typed in its place is in that unit."""
        word, line, beside = self.specialValueText(), self.lineEdit(), self._beside
        beside.adjustSize()
        beside.move(line.width() - beside.width() - 4, (line.height() - beside.height()) // 2)
        room = line.width() - self.fontMetrics().horizontalAdvance(word) - beside.width() > 12
        beside.setVisible(bool(word) and self.text() == word and room)

    def _refuse(self, why: str) -> None:
        name = self.accessibleName()
        self.refused.emit(f"{name}: {why}" if name else why)

    def _read(self, text: str) -> float:
        """In the shown unit. InputError: no number, no such unit, out of range."""
        typed, special = text.removesuffix(self.suffix()).strip(), self.specialValueText()
        if special and typed in ("", special):
            return self.minimum()
        value = float(f"{self.unit.parse(typed) * self.unit.factor:.12g}")
        for beyond, what, limit in (
            (value < self.minimum(), "at least", self.minimum()),
            (value > self.maximum(), "at most", self.maximum()),
        ):
            if beyond:
                raise InputError(f"must be {what} {limit:.10g}{self.suffix()}")
        return value
