"""Editors of single values: texts, lists of numbers, curves, choices and flags. Numbers are in `number_field`.

Each shows one value (`show_value`), says what was entered (`entered`), and wears a red outline while `invalid` is set.
Values are as stored (SI); what a field shows and reads is its spec's unit.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QFocusEvent,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QPaintEvent,
    QPalette,
    QPen,
)
from PySide6.QtWidgets import QCheckBox, QLineEdit, QToolButton, QWidget

from render.base.errors import InputError
from studio.editing.forms import FieldSpec, choice_label
from studio.editing.units import plain
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox


class TextField(QLineEdit):
    """A line of text that is entered by Return or by leaving it; Escape brings the old one back."""

    entered = Signal(object)
    refused = Signal(str)
    """While typing: why the text will not do; empty when it will."""
    given_up = Signal()
    """What was typed will not do and is about to be dropped, as the field is left."""
    menu_asked = Signal(object)
    """A `QMenu` is about to open, for whoever has something to add."""

    def __init__(self, spec: FieldSpec, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.spec = spec
        self.pending = False
        """Something was typed and not entered yet."""
        self.invalid = False
        self._shown = ""
        self.textEdited.connect(self._edited)
        self.show_value(spec.value)

    def text_of(self, value: Any) -> str:
        return str(value)

    def read(self, text: str) -> Any:
        """The value of what is typed. InputError: why it is none."""
        return text

    def show_value(self, value: Any) -> None:
        """The document's value; what is being typed stays."""
        text = self.text_of(value)
        self._shown = text
        if self.pending:
            return
        if text != self.text():
            self.setText(text)
            self.setCursorPosition(0)

    def revert(self) -> None:
        """What was typed is dropped, the document's value comes back."""
        self.pending = False
        self.set_invalid(False)
        self.setText(self._shown)

    def set_invalid(self, invalid: bool) -> None:
        if invalid != self.invalid:
            self.invalid = invalid
            self.update()

    def enter(self) -> None:
        """Hand over what was typed, if anything was."""
        if not self.pending:
            return
        try:
            value = self.read(self.text())
        except InputError as error:
            self.set_invalid(True)
            self.refused.emit(reason(error))
            return
        self.pending = False
        self.entered.emit(value)

    def leave(self) -> None:
        """Hand over what was typed, as something else is done now; what will not do is dropped."""
        self.enter()
        if self.pending:
            self.given_up.emit()
            self.revert()
            self.refused.emit("")

    def reject(self) -> None:
        """The value was refused after all: what was typed stays, to be mended; a step of the arrows is not made."""
        self.pending = self.text() != self._shown
        self.set_invalid(self.pending)
        if not self.pending:
            self.given_up.emit()
            self.refused.emit("")

    def _edited(self, text: str) -> None:
        self.pending = text != self._shown
        try:
            self.read(text)
        except InputError as error:
            self.set_invalid(True)
            self.refused.emit(reason(error))
            return
        self.set_invalid(False)
        self.refused.emit("")

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            if self._document_undo(event):
                event.ignore()
                return False
            if self.takes_escape and event.key() == Qt.Key.Key_Escape:
                event.accept()
                return True
        return super().event(event)

    @property
    def takes_escape(self) -> bool:
        """Whether Escape is this field's, before it is the window's."""
        return self.pending

    def _document_undo(self, event: QKeyEvent) -> bool:
        """Undo or redo while nothing is being typed is the document's."""
        keys = (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo)
        return not self.pending and any(event.matches(key) for key in keys)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.enter()
            if not self.invalid:
                self.selectAll()
            return
        if event.key() == Qt.Key.Key_Escape and self.pending:
            self.revert()
            self.refused.emit("")
            return
        if self._document_undo(event):
            event.ignore()
            return
        super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in (Qt.FocusReason.PopupFocusReason, Qt.FocusReason.ActiveWindowFocusReason):
            self.leave()
            self.deselect()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        menu = self.createStandardContextMenu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        before = len(menu.actions())
        self.menu_asked.emit(menu)
        if len(menu.actions()) > before:
            menu.insertSeparator(menu.actions()[before])
        menu.popup(event.globalPos())

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.invalid:
            outline(self)


class NumbersField(TextField):
    """As many numbers as there are, separated by spaces or commas."""

    def text_of(self, value: Any) -> str:
        return " ".join(plain(number * self.spec.unit.factor, 6) for number in value)

    def read(self, text: str) -> Any:
        values = tuple(self.spec.unit.parse(part) for part in text.replace(",", " ").split())
        problem = self.spec.problem(values)
        if problem is not None:
            raise InputError(problem)
        return values


class CurveField(TextField):
    """A curve over wavelength as pairs "450:0.6 500:0.66"; entered as the fields of a SpectralCurve."""

    def text_of(self, value: Any) -> str:
        return "  ".join(f"{plain(x, 3)}:{plain(y, 4)}" for x, y in zip(value.wavelength_nm, value.value, strict=True))

    def read(self, text: str) -> Any:
        try:
            pairs = [tuple(float(part) for part in pair.split(":")) for pair in text.replace(",", " ").split()]
            nm, value = zip(*((x, y) for x, y in pairs), strict=True)
        except ValueError:
            raise InputError("must be pairs such as 450:0.6 500:0.66") from None
        if any(not 0.0 <= y <= 1.0 for y in value):
            raise InputError("must lie between 0 and 1")
        if any(b <= a for a, b in pairwise(nm)):
            raise InputError("wavelengths must ascend")
        return {"wavelength_nm": nm, "value": value}


class CurvePlot(QWidget):
    """A small picture of a curve over wavelength."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedHeight(56)
        self.curve: Any = None

    def show_curve(self, curve: Any) -> None:
        self.curve = curve
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        area = QRectF(self.rect()).adjusted(0.5, 2.5, -0.5, -14)
        faint = QColor(theme.colours().line)
        painter.setPen(faint)
        painter.drawRect(area)
        low, high = self.curve.wavelength_nm[0], self.curve.wavelength_nm[-1]
        span = max(high - low, 1.0)
        points = [
            QPointF(area.left() + (x - low) / span * area.width(), area.bottom() - y * area.height())
            for x, y in zip(self.curve.wavelength_nm, self.curve.value, strict=True)
        ]
        painter.setPen(QPen(self.palette().color(QPalette.ColorRole.Highlight), 1.6))
        painter.drawPolyline(points)
        painter.setPen(QColor(theme.colours().muted))
        font = painter.font()
        font.setPointSizeF(font.pointSizeF() * 0.8)
        painter.setFont(font)
        ends = self.rect().adjusted(1, 0, -1, 0)
        painter.drawText(ends, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom, f"{low:g} nm")
        painter.drawText(ends, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom, f"{high:g} nm")
        painter.end()


class FlagField(QCheckBox):
    """Yes or no."""

    entered = Signal(object)

    def __init__(self, spec: FieldSpec, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.spec = spec
        self.show_value(spec.value)
        self.clicked.connect(lambda checked: self.entered.emit(checked))

    def show_value(self, value: Any) -> None:
        self._shown = bool(value)
        self.setChecked(self._shown)

    def reject(self) -> None:
        """The value was refused: the old one stays."""
        self.setChecked(self._shown)


class ChoiceField(ChoiceBox):
    """One of a few values."""

    entered = Signal(object)

    def __init__(self, values: list[tuple[str, Any, str]], parent: QWidget | None = None) -> None:
        """values: label, value, help."""
        super().__init__(parent)
        self.setSizeAdjustPolicy(ChoiceBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(6)
        self.invalid = False
        self.values: list[Any] = []
        self.offer(values)
        self.activated.connect(lambda index: self.entered.emit(self.values[index]))

    def offer(self, values: list[tuple[str, Any, str]]) -> None:
        """Others to choose from; then the value is to be shown again."""
        if self.values == [value for _, value, _ in values]:
            return
        self.clear()
        self.values = [value for _, value, _ in values]
        for i, (label, _, help) in enumerate(values):
            self.addItem(label)
            if help:
                self.setItemData(i, help, Qt.ItemDataRole.ToolTipRole)

    @classmethod
    def of(cls, spec: FieldSpec) -> ChoiceField:
        labels = spec.labels or [choice_label(value) for value in spec.choices]
        field = cls([(label, value, "") for label, value in zip(labels, spec.choices, strict=True)])
        field.show_value(spec.value)
        return field

    def show_value(self, value: Any) -> None:
        self._shown = self.values.index(value)
        self.setCurrentIndex(self._shown)

    def reject(self) -> None:
        """The value was refused: the old one stays."""
        self.setCurrentIndex(self._shown)

    def set_invalid(self, invalid: bool) -> None:
        if invalid != self.invalid:
            self.invalid = invalid
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.invalid:
            outline(self)


def outline(field: QWidget) -> None:
    """Around what will not do."""
    painter = QPainter(field)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(QColor(theme.colours().error), 1.5))
    painter.drawRoundedRect(QRectF(field.rect()).adjusted(1, 1, -1, -1), 2, 2)
    painter.end()


def tool_button(text: str, tip: str) -> QToolButton:
    """A small flat button."""
    button = QToolButton()
    button.setText(text)
    button.setToolTip(tip)
    return button


def reason(error: InputError) -> str:
    """For beside the field: what is wrong and what would do."""
    text = error.what
    if error.allowed:
        text += f"; allowed: {error.allowed}"
    return text
