"""Which laser a panel is of: the one that was selected last, wherever it was."""

from __future__ import annotations

from PySide6.QtCore import QSignalBlocker, Signal
from PySide6.QtWidgets import QWidget

from studio.editing.scene_edits import LASERS
from studio.project.document import FieldPath
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.session import Session


def laser_of(path: FieldPath) -> int | None:
    """The laser that an item or field of the scene is of; None: it is of none."""
    return int(path[3]) if path[:3] == LASERS and len(path) > 3 else None


class LaserBox(ChoiceBox):
    """One of several lasers, hidden where there are fewer; choosing it selects it everywhere.

    Those of a render may be others than the project has now: they are known by name.
    """

    chosen = Signal()
    """`laser` may be another."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._wanted = ""
        """The name of the one that was selected: a new one is before panels have it."""
        self.setVisible(False)
        self.activated.connect(self._choose)
        session.selection_changed.connect(self._follow)

    @property
    def laser(self) -> int:
        """Its index, 0 where there is none."""
        return max(0, self.currentIndex())

    def show_names(self, names: list[str]) -> None:
        """Of the lasers that there are."""
        before = self.laser
        if names != [self.itemText(i) for i in range(self.count())]:
            with QSignalBlocker(self):
                self.clear()
                self.addItems(names)
        self.setCurrentIndex(names.index(self._wanted) if self._wanted in names else min(before, len(names) - 1))
        self.setVisible(len(names) > 1)

    def _follow(self) -> None:
        selected, lasers = laser_of(self._session.selection), self._session.project.scene.lasers
        if selected is not None and selected < len(lasers):
            self._take(lasers[selected].name)

    def _choose(self, index: int) -> None:
        name = self.itemText(index)
        names = [laser.name for laser in self._session.project.scene.lasers]
        if name in names:
            self._session.select((*LASERS, names.index(name)))
        self._take(name)

    def _take(self, name: str) -> None:
        if name == self._wanted:
            return
        self._wanted = name
        index = self.findText(name)
        if index >= 0:
            self.setCurrentIndex(index)
            self.chosen.emit()
