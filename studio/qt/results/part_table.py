"""The table of the part's measures: names can be read, however long a figure or a verdict is."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidgetItem

from studio.qt.results.measures_table import ReadOnlyTable

HEADINGS = ("Name", "Value", "Sigma", "Error", "Verdict")
NAME, VERDICT = 0, len(HEADINGS) - 1
READABLE = 16
"""Characters of a name that are seen at least, if it is as long."""
SHORTEST = "? undecided"
"""Of a verdict so much is seen; what else is told with it may be cut, and is in the tooltip."""

ROUNDED = 2
"""px, by which a text may be wider than its letters are told."""


class PartTable(ReadOnlyTable):
    """One measure can be chosen. Figures have the room that they take, names and verdicts share what is left."""

    def __init__(self) -> None:
        super().__init__()
        self.setColumnCount(len(HEADINGS))
        self.setHorizontalHeaderLabels(list(HEADINGS))
        self.verticalHeader().hide()
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setWordWrap(False)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        head = self.horizontalHeaderItem(NAME) or QTableWidgetItem()
        head.setTextAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.fit()

    def fit(self) -> None:
        """The columns to their contents: verdicts as long as they are before names have more than they must."""
        wanted = [self._wanted(column) for column in range(len(HEADINGS))]
        figures, letters = wanted[NAME + 1 : VERDICT], self.fontMetrics()
        padding = wanted[VERDICT] - max(map(letters.horizontalAdvance, self._texts(VERDICT))) + ROUNDED
        name = min(wanted[NAME], READABLE * letters.averageCharWidth() + padding)
        verdict = min(wanted[VERDICT], letters.horizontalAdvance(SHORTEST) + padding)
        left = self.viewport().width() - sum(figures) - name
        verdict = max(verdict, min(wanted[VERDICT], left))
        for column, width in enumerate([name + max(0, left - verdict), *figures, verdict]):
            self.setColumnWidth(column, width)

    def _texts(self, column: int) -> list[str]:
        """Of all rows, seen or not, and what stands over them."""
        items = [self.item(row, column) for row in range(self.rowCount())]
        return [HEADINGS[column], *(item.text() for item in items if item is not None)]

    def _wanted(self, column: int) -> int:
        """px in which all of a column can be read."""
        rows = [self.sizeHintForIndex(self.model().index(row, column)).width() for row in range(self.rowCount())]
        return max(self.horizontalHeader().sectionSizeHint(column), *rows, 0)
