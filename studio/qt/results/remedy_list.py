"""What would fix the read-outs that are out of range: each a sentence with its gain, applied by a click."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from studio.preview.preview import Look
from studio.preview.remedies import Remedy, remedies
from studio.project.project import Project
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
            self._show(remedies(self._live.look, self.laser, self._look_at))

    def apply(self, remedy: Remedy) -> None:
        """Change the project; what was found for another one is looked for again."""
        if self._live.look.project is self.session.project:
            self.session.document.apply(remedy.label, remedy.project)
            self.session.message.emit("info", sentence(remedy))
        else:
            self._timer.start()

    def _look_at(self, project: Project) -> Look:
        return self._live.preview.look(project, self.session.document.root, self._live.step, wait=False)

    def _show(self, found: tuple[Remedy, ...]) -> None:
        self.setVisible(bool(found))
        if [(one.label, one.gain) for one in found] == [(one.label, one.gain) for one in self.found]:
            self.found = found
            return
        self.found = found
        self.changed.emit()
        while (item := self.grid.takeAt(0)) is not None:
            if (widget := item.widget()) is not None:
                widget.hide()
                widget.deleteLater()
        head = QLabel("<b>What would fix it</b>")
        self.grid.addWidget(head, 0, 0, 1, 2)
        for i, one in enumerate(found, start=1):
            told = QLabel(sentence(one), wordWrap=True)
            button = text_button("Apply", "Ctrl+Z takes it back")
            button.clicked.connect(partial(self._apply_row, i - 1))
            self.grid.addWidget(told, i, 0)
            self.grid.addWidget(button, i, 1)

    def _apply_row(self, index: int, _checked: bool = False) -> None:
        if index < len(self.found):
            self.apply(self.found[index])


def sentence(remedy: Remedy) -> str:
    """What is done, and what it gains."""
    return f"{remedy.label[:1].upper()}{remedy.label[1:]}: {remedy.gain}"
