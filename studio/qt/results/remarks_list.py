"""What a reader of the results should notice, one sentence below the other."""

from __future__ import annotations

from html import escape

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFrame, QLabel, QScrollArea


class Remarks(QScrollArea):
    """It scrolls where there is no room."""

    def __init__(self) -> None:
        super().__init__(widgetResizable=True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.text = QLabel(wordWrap=True, textFormat=Qt.TextFormat.RichText)
        self.text.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.text.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.text.setContentsMargins(8, 8, 8, 8)
        self.setWidget(self.text)

    def show_texts(self, texts: list[str]) -> None:
        listed = "".join(f"<p style='margin: 0 0 6px 0'>{escape(text)}</p>" for text in texts)
        self.text.setText(f"<p style='margin: 0 0 6px 0'><b>Worth noticing</b></p>{listed}" if texts else "")
