"""The steps of a scan, and beside or below them why figures are not what they seem."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QBoxLayout, QWidget

from studio.qt.results.head_banner import HeadBanner

LEAST = 300
"""px that the words need beside the steps."""


class HeadRow(QWidget):
    """Side by side where there is room."""

    def __init__(self, steps: QWidget) -> None:
        super().__init__()
        self.steps, self.banner = steps, HeadBanner()
        self.row = QBoxLayout(QBoxLayout.Direction.LeftToRight, self)
        self.row.setContentsMargins(0, 0, 0, 0)
        for part in (steps, self.banner):
            self.row.addWidget(part, 1)

    def tell(self, texts: Sequence[str]) -> None:
        self.banner.tell(texts)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        beside = self.width() >= self.steps.sizeHint().width() + LEAST
        self.row.setDirection(QBoxLayout.Direction.LeftToRight if beside else QBoxLayout.Direction.TopToBottom)
