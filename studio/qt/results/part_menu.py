"""The menu of a measure in the table: another laser for it, and delete."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QObject, QPoint, Qt
from PySide6.QtWidgets import QMenu, QTableWidget

from studio.qt.core.session import Session


class PartMenu(QObject):
    """A right click, or the menu key, on a row."""

    def __init__(self, session: Session, table: QTableWidget, delete: Callable[[], None]) -> None:
        """table: a row for each of the project's measures; delete: the chosen one."""
        super().__init__(table)
        self.session, self.table, self.delete = session, table, delete
        table.setContextMenuPolicy(Qt.ContextMenuPolicy.CustomContextMenu)
        table.customContextMenuRequested.connect(self._ask)

    def menu_of(self, row: int) -> QMenu:
        """Of several lasers each can have it; its regions stay where they are on the profile."""
        menu, project = QMenu(self.table), self.session.project
        if len(project.scene.lasers) > 1:
            lasers = menu.addMenu("Measure the line of")
            for i, laser in enumerate(project.scene.lasers):
                action = lasers.addAction(laser.name)
                action.setCheckable(True)
                action.setChecked(project.measures[row].laser == i)
                action.triggered.connect(partial(self._give, row, i))
        menu.addAction("Delete").triggered.connect(self.delete)
        return menu

    def _ask(self, place: QPoint) -> None:
        row = self.table.rowAt(place.y())
        if 0 <= row < len(self.session.project.measures):
            self.table.selectRow(row)
            self.menu_of(row).popup(self.table.viewport().mapToGlobal(place))

    def _give(self, row: int, laser: int, _checked: bool = False) -> None:
        gauge = self.session.project.measures[row]
        if gauge.laser != laser:
            name = self.session.project.scene.lasers[laser].name
            self.session.set(("measures", row, "laser"), laser, f"measure {gauge.name} on {name}")
