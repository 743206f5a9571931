"""The list of views: which of them count, how far off each is, and what was told of it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem, QWidget

from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.core import theme

ROW_PX = 22
COLUMNS = ("View", "rms / px", "Remark")
NAME = Qt.ItemDataRole.UserRole
TIP = (
    "A view that is not ticked is left out, and the rest is adjusted again. Its own rms is then what it is off by a "
    "calibration that it has no part in"
)


class ViewTable(QTableWidget):
    """Space ticks a view; the current one is shown beside."""

    def __init__(self, work: CalibrationWork, parent: QWidget | None = None) -> None:
        super().__init__(0, len(COLUMNS), parent)
        self.work = work
        for column, title in enumerate(COLUMNS):
            heading = QTableWidgetItem(title)
            heading.setToolTip(f"<p>{TIP}</p>")
            heading.setTextAlignment(Qt.AlignmentFlag.AlignRight if column == 1 else Qt.AlignmentFlag.AlignLeft)
            self.setHorizontalHeaderItem(column, heading)
        self.setAccessibleName("Views")
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setShowGrid(False)
        self.setAlternatingRowColors(True)
        self.setTabKeyNavigation(False)
        self.setTextElideMode(Qt.TextElideMode.ElideRight)
        self.setWordWrap(False)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        header, mode = self.horizontalHeader(), QHeaderView.ResizeMode
        header.setHighlightSections(False)
        for column, kind in enumerate((mode.ResizeToContents, mode.ResizeToContents, mode.Stretch)):
            header.setSectionResizeMode(column, kind)
        header.setMinimumSectionSize(48)
        for changed in (work.material_changed, work.solved_changed, theme.notice.changed):
            changed.connect(self.refresh)
        work.counted_changed.connect(self._show_ticks)
        work.shown_changed.connect(self._mark)
        self.itemChanged.connect(self._tick)
        self.currentCellChanged.connect(self._choose)
        self.refresh()

    def refresh(self) -> None:
        """Every view, then the files that are not used."""
        work = self.work
        self.blockSignals(True)
        self.setRowCount(0)
        if work.material is not None:
            rows = {} if work.solved is None else {row.name: row for row, _ in work.solved.rows}
            for view in work.material.views:
                found = rows.get(view.name)
                dropped = view.name in work.dropped
                remarks = list(found.remarks) if found is not None else []
                told = {"dropped": ["dropped"], "left out": ["left out"]}.get(found.part, []) if found else []
                rms = f"{found.rms:.3f}" if found is not None and found.rms is not None else ""
                self._add(view.name, rms, "; ".join([*told, *remarks]), dropped, faint=bool(told))
            for fault in work.material.errors:
                self._add_fault(fault)
        self.blockSignals(False)
        self._mark()

    def _add(self, name: str, rms: str, remark: str, dropped: bool, *, faint: bool) -> None:
        row = self.rowCount()
        self.insertRow(row)
        first = QTableWidgetItem(name)
        first.setData(NAME, name)
        first.setFlags(first.flags() | Qt.ItemFlag.ItemIsUserCheckable)
        first.setCheckState(Qt.CheckState.Unchecked if dropped else Qt.CheckState.Checked)
        second = QTableWidgetItem(rms)
        second.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        third = QTableWidgetItem(remark)
        third.setToolTip(f"<p>{remark}</p>" if remark else "")
        for column, item in enumerate((first, second, third)):
            if faint or column == 2:
                item.setForeground(QColor(theme.colours().muted))
            self.setItem(row, column, item)

    def _add_fault(self, fault: str) -> None:
        """A file that is not used, and why."""
        where, _, why = fault.partition(": ")
        row = self.rowCount()
        self.insertRow(row)
        name = QTableWidgetItem(Path(where).name)
        reason = QTableWidgetItem(why)
        for column, item in ((0, name), (2, reason)):
            item.setForeground(QColor(theme.colours().error))
            item.setToolTip(f"<p>{fault}</p>")
            item.setFlags(Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable)
            self.setItem(row, column, item)

    def _show_ticks(self) -> None:
        self.blockSignals(True)
        for item in self._names():
            dropped = item.data(NAME) in self.work.dropped
            item.setCheckState(Qt.CheckState.Unchecked if dropped else Qt.CheckState.Checked)
        self.blockSignals(False)
        self.viewport().update()

    def _mark(self) -> None:
        """The view that is shown is the current row."""
        for item in self._names():
            if item.data(NAME) == self.work.shown and self.currentRow() != item.row():
                self.setCurrentItem(item)

    def _names(self) -> list[QTableWidgetItem]:
        """Of the views, not of files that are not used."""
        items = (self.item(row, 0) for row in range(self.rowCount()))
        return [item for item in items if item is not None and item.data(NAME)]

    def _tick(self, item: QTableWidgetItem) -> None:
        name = item.data(NAME)
        if item.column() == 0 and name:
            self.work.drop(name, dropped=item.checkState() == Qt.CheckState.Unchecked)

    def _choose(self, row: int, *_: int) -> None:
        item = self.item(row, 0)
        if item is not None and item.data(NAME):
            self.work.show(item.data(NAME))
