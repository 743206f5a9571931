"""A line above all figures, in the colour of a warning, with what is to be known before they are read."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from PySide6.QtWidgets import QFrame, QLabel, QVBoxLayout

from studio.qt.core import theme


class HeadBanner(QFrame):
    """Without room of its own while it says nothing, which a low window has not."""

    def __init__(self) -> None:
        super().__init__()
        self.text = QLabel(wordWrap=True)
        self.text.setMinimumWidth(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 3, 8, 3)
        column.addWidget(self.text)

    def tell(self, told: Sequence[str]) -> None:
        """Nothing: it is not seen."""
        self.text.setText("   ".join(told))
        self.text.setToolTip("".join(f"<p>{escape(text)}</p>" for text in told))
        self.setVisible(bool(told))

    def repaint_theme(self) -> None:
        colours = theme.colours()
        ground = theme.mixed(colours.warning, colours.window, 0.3)
        self.setStyleSheet(f"QFrame, QLabel {{ background: {ground}; }}")
