"""What a study has found: a chart of each sweep, its findings in words, and a table of its points."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QLabel,
    QStackedLayout,
    QTabBar,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import flush, upper_and_lower
from studio.qt.study.cell_opener import CellOpener
from studio.qt.study.chart_view import ChartView
from studio.qt.study.study_work import StudyWork
from studio.study.answers import Answer
from studio.study.study import told_laser

NOTHING = (
    "Nothing is measured yet. Choose a field to vary and run the study: charts fill while it runs, "
    "and a click on a point opens its frame, line and errors."
)
OPENS = "A click on a point, or two on its row, open its frame, line and errors in Measure."
ROW_PX = 22


class ChartsPanel(QWidget):
    """Follows the `StudyWork` of the session; a click or Return opens the cell behind a point."""

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.runner = runner
        self.work = one_of(StudyWork, session)
        self.opener = one_of(CellOpener, session)
        self.tabs = QTabBar(expanding=False, usesScrollButtons=True, elideMode=Qt.TextElideMode.ElideNone)
        self.tabs.setDrawBase(False)
        self.question, self.findings = QLabel(wordWrap=True), QLabel(wordWrap=True)
        self.question.setObjectName("muted")
        self.findings.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.chart = ChartView()
        self.reading = QLabel(wordWrap=True)
        self.reading.setMinimumHeight(2 * self.reading.fontMetrics().lineSpacing())
        self.table = QTableWidget()
        self._header: list[str] = []
        self._texts: list[list[str]] = []
        """Of the table, by row."""
        self.table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.table.setShowGrid(False)
        self.table.setAlternatingRowColors(True)
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.table.setToolTip("Return or a double-click opens the frame, line and errors behind a row")
        self._lay_out()
        work = self.work
        work.found_changed.connect(self.refresh)
        work.draft_changed.connect(self._follow_sweep)
        self.tabs.currentChanged.connect(work.choose_sweep)
        self.chart.hovered.connect(self._hover)
        self.chart.chosen.connect(self.open)
        self.table.itemActivated.connect(lambda item: self.open(item.row()))
        self.table.currentCellChanged.connect(lambda row, *_: self._tell(row if row >= 0 else None))
        self.refresh()

    def closeEvent(self, event: QCloseEvent) -> None:
        for part in (self.chart, self.work):
            part.close()
        super().closeEvent(event)

    @property
    def answer(self) -> Answer | None:
        """Of the chosen sweep."""
        found, chosen = self.work.found, self.work.chosen
        return found.answers[chosen] if found is not None and chosen < len(found.answers) else None

    def open(self, spot: int) -> None:
        """Look at the cell behind a point in Measure."""
        if self.work.found is not None and self.answer is not None:
            self.table.selectRow(spot)
            self.opener.open(self.work.found, self.work.chosen, spot, self.runner)

    def refresh(self) -> None:
        """Draw what was found so far."""
        found, answer = self.work.found, self.answer
        self._show_tabs([one.sweep.name for one in found.answers] if found is not None else [])
        have = answer is not None and bool(answer.spots)
        self.stack.setCurrentIndex(1 if have else 0)
        if found is None or answer is None or not have:
            self.chart.show_answer(None, {})
            return
        from studio.study.charts import field_label  # matplotlib takes a moment: not before there is a chart
        from studio.study.labels import as_read
        from studio.study.page import columns, sentences, table

        answer, labels = as_read(answer, found.bases.values())
        asked = [
            one for one in (answer.sweep.question, *told_laser(found.study, found.bases, answer.sweep.base)) if one
        ]
        self.question.setText(" · ".join(asked))
        self.question.setVisible(bool(asked))
        said = sentences(answer, labels)
        self.findings.setText("\n".join(said))
        self.findings.setVisible(bool(said))
        self.chart.show_answer(answer, labels)
        header = [*(field_label(one, labels) for one in answer.sweep.vary), "method", *columns(answer)]
        self._texts = table(answer)
        self._fill(header, self._texts)
        self._tell(self.chart.spot)

    def _follow_sweep(self) -> None:
        self.tabs.blockSignals(True)
        self.tabs.setCurrentIndex(self.work.chosen)
        self.tabs.blockSignals(False)

    def _show_tabs(self, names: list[str]) -> None:
        self.tabs.blockSignals(True)
        if names != [self.tabs.tabText(i) for i in range(self.tabs.count())]:
            while self.tabs.count():
                self.tabs.removeTab(0)
            for name in names:
                self.tabs.setTabToolTip(self.tabs.addTab(name), name)
        self.tabs.setCurrentIndex(self.work.chosen)
        self.tabs.setVisible(len(names) > 1)
        self.tabs.blockSignals(False)

    def _fill(self, header: list[str], rows: list[list[str]]) -> None:
        widget, self._header = self.table, header
        widget.blockSignals(True)
        widget.setColumnCount(len(header))
        widget.setRowCount(len(rows))
        widget.setHorizontalHeaderLabels(header)
        for i, row in enumerate(rows):
            for k, text in enumerate(row):
                item = QTableWidgetItem(text)
                if k != header.index("method"):
                    item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
                widget.setItem(i, k, item)
        widget.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        widget.blockSignals(False)

    def _hover(self, spot: int | None) -> None:
        if spot is None:
            row = self.table.currentRow()
            spot = row if row >= 0 else None
        self._tell(spot)

    def _tell(self, spot: int | None) -> None:
        """Ring a spot and tell its numbers."""
        answer = self.answer
        if answer is None or spot is None or spot >= len(answer.spots):
            self.chart.mark(None)
            self.reading.setText(OPENS)
            return
        self.chart.mark(spot)
        pairs = zip(self._header, self._texts[spot], strict=True)
        self.reading.setText(", ".join(f"{name} {text}" for name, text in pairs))

    def _lay_out(self) -> None:
        empty = QLabel(NOTHING, wordWrap=True)
        empty.setObjectName("muted")
        empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        empty.setContentsMargins(40, 0, 40, 0)
        picture = QWidget()
        upper = QVBoxLayout(picture)
        upper.setContentsMargins(8, 4, 8, 2)
        upper.setSpacing(4)
        upper.addWidget(self.question)
        upper.addWidget(self.chart, 1)
        upper.addWidget(self.reading)
        upper.addWidget(self.findings)
        full = upper_and_lower(picture, self.table, (420, 150))
        full.setCollapsible(0, False)
        holder = QWidget()
        self.stack = QStackedLayout(holder)
        self.stack.addWidget(empty)
        self.stack.addWidget(full)
        flush(QVBoxLayout(self), self.tabs).addWidget(holder, 1)
