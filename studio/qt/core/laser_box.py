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
    """One of several lasers, hidden where there are fewer; choosing it selects it everywhere."""

    chosen = Signal()
    """`laser` may be another."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session = session
        self._wanted = 0
        """The one that was selected: a new one is before panels have it."""
        self.setVisible(False)
        self.activated.connect(self._choose)
        session.selection_changed.connect(self._follow)
        session.document_replaced.connect(self._begin_anew)

    @property
    def laser(self) -> int:
        """Its index, 0 where there is none."""
        return max(0, min(self._wanted, self.count() - 1))

    def show_names(self, names: list[str]) -> None:
        """Of the lasers that there are."""
        if names != [self.itemText(i) for i in range(self.count())]:
            with QSignalBlocker(self):
                self.clear()
                self.addItems(names)
        self.setCurrentIndex(self.laser if names else -1)
        self.setVisible(len(names) > 1)

    def _follow(self) -> None:
        selected = laser_of(self._session.selection)
        if selected is not None and selected != self._wanted:
            self._take(selected)

    def _begin_anew(self) -> None:
        self._take(0)

    def _choose(self, index: int) -> None:
        if index < len(self._session.project.scene.lasers):
            self._session.select((*LASERS, index))
        self._take(index)

    def _take(self, index: int) -> None:
        self._wanted = index
        self.setCurrentIndex(self.laser)
        self.chosen.emit()
