"""Lists to choose from, numbers and sliders, as every panel has them: the wheel scrolls the panel, and changes nothing.

Qt's own take the wheel wherever the mouse comes over them, so that scrolling a panel changed a setting on its way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence, QWheelEvent
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QSlider, QSpinBox, QWidget

GIVEN_BACK = (Qt.FocusReason.ActiveWindowFocusReason, Qt.FocusReason.PopupFocusReason)
"""The focus comes back from another window, or a list that was open."""

if TYPE_CHECKING:
    Base = QWidget
else:
    Base = object


class StillBox(Base):
    """To stand before a class of Qt: the wheel is its own while it has the focus, by a click or Tab."""

    _by_hand = False

    def __init__(self, *given: Any, **properties: Any) -> None:
        super().__init__(*given, **properties)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def focusInEvent(self, event: QFocusEvent) -> None:
        if event.reason() not in GIVEN_BACK:
            self._by_hand = event.reason() in (Qt.FocusReason.MouseFocusReason, Qt.FocusReason.ShortcutFocusReason)
        super().focusInEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        # Qt names Tab as the reason also where it hands on the focus of what is hidden; only the key ends here
        self._by_hand |= event.key() in (Qt.Key.Key_Tab, Qt.Key.Key_Backtab)
        super().keyReleaseEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus() and self._by_hand:
            super().wheelEvent(event)
        else:
            event.ignore()


class ChoiceBox(StillBox, QComboBox):
    """One of a list."""


class NumberBox(StillBox):
    """A box of a number, which is to be undone where the number is kept, and not in the box."""

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            keys = (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo)
            if not self.lineEdit().isModified() and any(event.matches(key) for key in keys):  # type: ignore[attr-defined]
                event.ignore()
                return False
        return super().event(event)


class WholeBox(NumberBox, QSpinBox):
    """A whole number."""


class DecimalBox(NumberBox, QDoubleSpinBox):
    """A number with decimals."""


class Slider(StillBox, QSlider):
    """A place between two ends."""
