"""The steps of a scan, and beside or below them why figures are not what they seem."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QFrame, QLabel, QVBoxLayout, QWidget

LEAST = 300
"""px that the words need beside the steps."""


class HeadRow(QWidget):
    """The words are gone where there are none."""

    def __init__(self, steps: QWidget) -> None:
        super().__init__()
        self.steps = steps
        self.frame = QFrame()
        self.text = QLabel(wordWrap=True)
        self.text.setMinimumWidth(1)
        column = QVBoxLayout(self.frame)
        column.setContentsMargins(8, 3, 8, 3)
        column.addWidget(self.text)
        self.row = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self.row.setContentsMargins(0, 0, 0, 0)
        for part in (steps, self.frame):
            self.row.addWidget(part, 1)

    def tell(self, texts: Sequence[str]) -> None:
        self.text.setText("   ".join(texts))
        self.text.setToolTip("".join(f"<p>{escape(text)}</p>" for text in texts))
        self.frame.setVisible(bool(texts))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        beside = self.width() >= self.steps.sizeHint().width() + LEAST
        self.row.setDirection(QBoxLayout.Direction.LeftToRight if beside else QBoxLayout.Direction.TopToBottom)
