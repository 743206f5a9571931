"""Numbers with a unit that are typed, or dragged sideways, and several of them side by side."""

from __future__ import annotations

import math
from typing import Any

from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtGui import (
    QFocusEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QResizeEvent,
)
from PySide6.QtWidgets import QApplication, QHBoxLayout, QWidget

from render.base.errors import InputError
from studio.editing.forms import FieldSpec
from studio.qt.forms.fields import TextField

STEPS = {"mm": 0.2, "µm": 0.05, "deg": 0.1, "mrad": 0.005, "mW": 0.1, "ms": 0.01, "nm": 0.5, "px": 0.1, "e-": 5.0,
         "cm": 0.02, "m": 2e-4, "in": 0.01}  # fmt: skip
"""Change per pixel of a drag at least, in shown units."""
EMPTY_TEXT = {"focus_distance": "far away", "gain": "automatic", "width": "measured"}


class NumberField(TextField):
    """A number with its unit. Typed after a click; dragged sideways without one: Shift is finer, Control coarser."""

    drag_began = Signal()
    dragged = Signal(object)
    drag_ended = Signal(bool)
    """True: kept; False: given up by Escape."""

    def __init__(self, spec: FieldSpec, parent: QWidget | None = None, unit: bool = True) -> None:
        self.suffix = spec.unit.shown if unit else ""
        super().__init__(spec, parent)
        # focus comes on release, when it is known that no drag was meant
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setCursor(Qt.CursorShape.SizeHorCursor)
        self.setMinimumWidth(44)
        self._value: float | None = spec.value
        self._pressed: QPoint | None = None
        self._dragging = False
        if spec.optional:
            self.setPlaceholderText(EMPTY_TEXT.get(spec.name, "none"))
        if self.suffix:
            width = self.fontMetrics().horizontalAdvance(self.suffix)
            self.setTextMargins(0, 0, width + 6, 0)

    @property
    def takes_escape(self) -> bool:
        return self.pending or self._dragging

    def text_of(self, value: Any) -> str:
        if value is None:
            return ""
        return str(value) if self.spec.kind == "integer" else self.spec.unit.format(value)

    def read(self, text: str) -> Any:
        if self.spec.optional and not text.strip():
            return None
        try:
            value: float = self.spec.unit.parse(text)
        except InputError as error:
            if self.spec.kind != "integer":
                raise
            raise InputError(error.what, found=error.found, allowed=self._whole()) from None
        if self.spec.kind == "integer":
            if value != int(value):
                raise InputError("must be a whole number", allowed=self._whole())
            value = int(text) if text.strip().lstrip("+-").isdigit() else int(value)
        problem = self.spec.problem(value)
        if problem is not None:
            raise InputError(problem)
        return value

    def _whole(self) -> str:
        """What an integer may be."""
        spec = self.spec
        low, high = spec.low, spec.high
        low = low + 1 if low is not None and spec.low_open else low
        high = high - 1 if high is not None and spec.high_open else high
        ends = [f"{word} {spec.unit.with_unit(end)}" for word, end in (("from", low), ("to", high)) if end is not None]
        return " ".join(["a whole number", *ends])

    def show_value(self, value: Any) -> None:
        self._value = value
        super().show_value(value)
        self._fit()

    def _fit(self) -> None:
        """Shorten a number that does not fit, as long as it is only looked at."""
        if self.pending or self._value is None or self.spec.kind == "integer":
            return
        text = self.text_of(self._value)
        margins = self.textMargins()
        room = self.width() - margins.left() - margins.right() - 10
        while not self.hasFocus() and "." in text and self.fontMetrics().horizontalAdvance(text) > room:
            text = text[:-1].rstrip(".") if "e" not in text else f"{float(text):.0e}"
        if text != self.text():
            self.setText(text)
            self.setCursorPosition(0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def step(self) -> float:
        """Change per pixel, stored units."""
        if self.spec.kind == "integer":
            return max(0.25, 0.002 * abs(self._value or 0))
        if self.spec.low == 0.0 and self.spec.high == 1.0:
            return 0.005
        shown = abs(self._value or 0.0) * self.spec.unit.factor
        least = STEPS.get(self.spec.unit.shown, 0.01)
        size = least if self.spec.unit.shown in ("mm", "deg") and shown < 200 else max(least / 10, 0.005 * shown)
        return 10.0 ** round(math.log10(size)) / self.spec.unit.factor

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or self.hasFocus():
            super().mousePressEvent(event)
            return
        self._pressed = event.globalPosition().toPoint()
        self._start = 0.0 if self._value is None else float(self._value)
        self._travelled = 0.0
        self._last = self._pressed

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """All of the number: a word ends at its point."""
        self.selectAll()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pressed is None:
            super().mouseMoveEvent(event)
            return
        here = event.globalPosition().toPoint()
        if not self._dragging:
            if abs(here.x() - self._pressed.x()) < QApplication.startDragDistance() // 2:
                return
            self._dragging = True
            self._step = self.step()
            self.grabKeyboard()
            self.drag_began.emit()
        keys = event.modifiers()
        rate = 0.1 if keys & Qt.KeyboardModifier.ShiftModifier else 1.0
        rate *= 10.0 if keys & Qt.KeyboardModifier.ControlModifier else 1.0
        self._travelled += (here.x() - self._last.x()) * rate
        self._last = here
        self.dragged.emit(self._drag_value())

    def _drag_value(self) -> Any:
        grain = self._step * 0.1
        value = round((self._start + self._travelled * self._step) / grain) * grain
        value = self.spec.clamped(float(f"{value:.12g}"))
        return round(value) if self.spec.kind == "integer" else value

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._pressed is None:
            super().mouseReleaseEvent(event)
            return
        self._pressed = None
        if self._dragging:
            self._end_drag(True)
        else:
            self.setFocus(Qt.FocusReason.MouseFocusReason)
            self.selectAll()

    def _end_drag(self, keep: bool) -> None:
        self._dragging, self._pressed = False, None
        self.releaseKeyboard()
        self.drag_ended.emit(keep)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if self._dragging:
            if event.key() == Qt.Key.Key_Escape:
                self._end_drag(False)
            return
        if event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down) and self._value is not None and not self.pending:
            sign = 1 if event.key() == Qt.Key.Key_Up else -1
            size = 1.0 if self.spec.kind == "integer" else 10 * self.step()
            fine = 0.1 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1.0
            value = self.spec.clamped(float(f"{self._value + sign * size * fine:.12g}"))
            self.entered.emit(round(value) if self.spec.kind == "integer" else value)
            self.selectAll()
            return
        super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self._fit()
        self.setCursor(Qt.CursorShape.IBeamCursor)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self._fit()
        self.setCursor(Qt.CursorShape.SizeHorCursor)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        # where none may be typed its unit is known before; "no line" is no number of degrees
        if self.suffix and (self.text() or self.spec.optional or not self.placeholderText()):
            painter = QPainter(self)
            painter.setPen(self.palette().color(QPalette.ColorRole.PlaceholderText))
            area = self.rect().adjusted(0, 0, -6, 0)
            painter.drawText(area, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, self.suffix)
            painter.end()


class VectorField(QWidget):
    """Numbers side by side, one for each axis or colour."""

    def __init__(self, specs: list[FieldSpec], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        self.fields = [NumberField(spec, self, unit=False) for spec in specs]
        for field in self.fields:
            layout.addWidget(field)
