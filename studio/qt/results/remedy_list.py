"""What would fix the read-outs that are out of range: each a sentence with its gain, applied by a click."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QPushButton, QWidget

from studio.preview.remedies import Remedy, remedies
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button

PAUSE_MS = 200
"""After the last change, so that nothing is tried while something is dragged."""


class RemedyList(QWidget):
    """Empty where nothing helps; what is applied is undone as any other edit."""

    changed = Signal()
    """`found` is another one."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session, self._live = session, live(session)
        self.found: tuple[Remedy, ...] = ()
        self.laser = 0
        self._timer = QTimer(self, singleShot=True, interval=PAUSE_MS)
        self._timer.timeout.connect(self.look)
        self.grid = QGridLayout(self)
        self.grid.setContentsMargins(0, 8, 0, 0)
        self.grid.setColumnStretch(0, 1)
        self.grid.addWidget(QLabel("<b>What would fix it</b>"), 0, 0, 1, 2)
        self._rows: list[tuple[QLabel, QPushButton]] = []
        self._show(())

    def follow(self, laser: int, needed: bool) -> None:
        """Look for what helps this laser, when nothing has changed for a moment; needed: something is out of range."""
        self.laser = laser
        if needed:
            self._timer.start()
        else:
            self._timer.stop()
            self._show(())

    def look(self) -> None:
        """Now."""
        session = self.session
        if session.dragging:
            self._timer.start()
        elif self._live.ready and self.laser < len(self._live.look.scene.lasers):
            self._show(remedies(self._live.look, self.laser, self._live.look_at))

    def apply(self, remedy: Remedy) -> None:
        """Change the project; what was found for another one is looked for again."""
        if self._live.look.project is self.session.project:
            self.session.document.apply(remedy.label, remedy.project)
            self.session.message.emit("info", sentence(remedy))
        else:
            self._timer.start()

    def _show(self, found: tuple[Remedy, ...]) -> None:
        self.setVisible(bool(found))
        if [sentence(one) for one in found] == [sentence(one) for one in self.found]:
            self.found = found
            return
        self.found = found
        for i, one in enumerate(found):
            if i == len(self._rows):
                self._rows.append(self._add(i))
            self._rows[i][0].setText(sentence(one))
        for i, row in enumerate(self._rows):
            for widget in row:
                widget.setVisible(i < len(found))
        self.changed.emit()

    def _add(self, index: int) -> tuple[QLabel, QPushButton]:
        told, button = QLabel(wordWrap=True), text_button("Apply", "Ctrl+Z takes it back")
        button.clicked.connect(partial(self._apply_row, index))
        self.grid.addWidget(told, index + 1, 0)
        self.grid.addWidget(button, index + 1, 1)
        return told, button

    def _apply_row(self, index: int, _checked: bool = False) -> None:
        if index < len(self.found):
            self.apply(self.found[index])


def sentence(remedy: Remedy) -> str:
    """What is done, what it gains, and what that costs."""
    label = remedy.label if remedy.label.startswith("f/") else remedy.label[:1].upper() + remedy.label[1:]
    return f"{label}: {remedy.gain}" + (f", at the cost of {remedy.price}" if remedy.price else "")
