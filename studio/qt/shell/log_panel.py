"""The log: every message of the session with its time, to read again, filter and copy."""

from __future__ import annotations

import datetime
import html

from PySide6.QtWidgets import (
    QApplication,
    QHBoxLayout,
    QPlainTextEdit,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.session import Session

KEPT = 2000
LEVELS = ("info", "warning", "error")
SHOWN = {"All messages": LEVELS, "Warnings and errors": LEVELS[1:], "Errors": LEVELS[2:]}


class LogPanel(QWidget):
    """Follows `session.message`."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.entries: list[tuple[str, str, str]] = []
        self.text = QPlainTextEdit(readOnly=True)
        self.text.setMaximumBlockCount(KEPT)
        self.text.setPlaceholderText("Nothing has happened yet.")
        self.level = ChoiceBox()
        self.level.addItems(list(SHOWN))
        self.level.currentTextChanged.connect(lambda _: self._show_all())
        copy = QToolButton()
        copy.setText("Copy")
        copy.setToolTip("Copy the whole log, for a report")
        copy.clicked.connect(lambda: QApplication.clipboard().setText(self.as_text()))
        clear = QToolButton()
        clear.setText("Clear")
        clear.clicked.connect(self.clear)
        bar = QHBoxLayout()
        bar.addWidget(self.level, 1)
        bar.addWidget(copy)
        bar.addWidget(clear)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 6, 8, 8)
        layout.addLayout(bar)
        layout.addWidget(self.text)
        session.message.connect(self.add)
        theme.notice.changed.connect(self._show_all)

    def add(self, level: str, text: str) -> None:
        """A message, at the present time."""
        entry = (datetime.datetime.now().strftime("%H:%M:%S"), level, text)
        self.entries.append(entry)
        del self.entries[:-KEPT]
        self._show(entry)

    def clear(self) -> None:
        self.entries.clear()
        self.text.clear()

    def as_text(self) -> str:
        return "\n".join(f"{time} {level:7} {text}" for time, level, text in self.entries)

    def _show_all(self) -> None:
        self.text.clear()
        for entry in self.entries:
            self._show(entry)

    def _show(self, entry: tuple[str, str, str]) -> None:
        time, level, text = entry
        if level not in SHOWN[self.level.currentText()]:
            return
        c = theme.colours()
        colour = {"warning": c.warning, "error": c.error}.get(level, c.text)
        escaped = html.escape(text).replace("\n", "<br>&nbsp;&nbsp;")
        self.text.appendHtml(
            f"<span style='color:{c.muted}'>{time}</span> <span style='color:{colour}'>{escaped}</span>"
        )
