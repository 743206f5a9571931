"""The results of the shown render: line, depth and error by scan line, profile, histogram, measures, all linked."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QColor, QPixmap
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QSizePolicy,
    QSplitter,
    QStackedLayout,
    QTableWidget,
    QTableWidgetItem,
    QTabWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from analysis.report.colour import TRUTH, method_colour, method_name
from studio.qt import theme
from studio.qt.results_histogram import ErrorHistogram
from studio.qt.results_profile import ProfilePlot
from studio.qt.results_rows import RowPlots
from studio.qt.session import Session
from studio.result_series import ERROR_VIEWS, ErrorView, error_values, measured_series, table, true_series
from studio.stages import Measurement

NOTHING = "Nothing is measured yet. Render the frame (F5): its line, points and errors appear here."


class ResultsPanel(QWidget):
    """Follows `session.shown`; hovering any plot hovers the scan line everywhere, a click keeps it."""

    view_changed = Signal(object)
    """Another `ErrorView` was chosen."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.pinned: int | None = None
        self.hidden: set[str] = set()
        """Methods that are switched off."""
        self.laser = QComboBox()
        self.error = QComboBox()
        self.error.addItems([view.title for view in ERROR_VIEWS])
        self.error.setToolTip("Which error the plots, the histogram and the table show")
        self.switches = QHBoxLayout()
        self.switches.setSpacing(2)
        self.reading = QLabel()
        self.reading.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.reading.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.rows, self.profile, self.histogram = RowPlots(), ProfilePlot(), ErrorHistogram()
        self.table = _measures_table()
        self._lay_out()
        self.laser.currentIndexChanged.connect(self.refresh)
        self.error.currentIndexChanged.connect(self.refresh)
        self.error.currentIndexChanged.connect(lambda _: self.view_changed.emit(self.view))
        for plot in (self.rows, self.profile):
            plot.hovered.connect(self._hover)
            plot.chosen.connect(self._pin)
        session.renders_changed.connect(self._another_render)
        session.measured.connect(self.refresh)
        session.hover_changed.connect(self._mark)
        theme.notice.changed.connect(self._repaint)
        self._another_render()

    @property
    def view(self) -> ErrorView:
        return ERROR_VIEWS[self.error.currentIndex()]

    def shown(self) -> dict[str, Measurement]:
        """Measurements of the chosen laser by the methods that are switched on."""
        render, laser = self.session.shown, max(0, self.laser.currentIndex())
        if render is None:
            return {}
        found = {method: each[laser] for method, each in render.measurements.items() if laser < len(each)}
        return {method: one for method, one in found.items() if method not in self.hidden}

    def refresh(self) -> None:
        """Draw everything anew."""
        render, laser = self.session.shown, max(0, self.laser.currentIndex())
        self._make_switches()
        have = render is not None and bool(render.measurements) and laser < len(render.frame.curves)
        self.stack.setCurrentIndex(1 if have else 0)
        if render is None or not have:
            return
        scene, shown, view = render.project.scene, self.shown(), self.view
        truth = true_series(render.frame.curves[laser], scene, laser)
        series = {method: measured_series(one, scene) for method, one in shown.items()}
        errors = {method: error_values(one.errors, view) for method, one in shown.items()}
        axis = render.frame.curves[laser].axis
        self.rows.show_series(axis, truth, {method: (series[method], errors[method]) for method in shown}, view)
        self.profile.show_series(truth, series)
        self.histogram.show_errors(errors, view)
        _fill(self.table, list(shown), table(list(shown.values()), view))
        self._mark()

    def _another_render(self) -> None:
        render = self.session.shown
        names = [] if render is None else [laser.name for laser in render.project.scene.lasers]
        if names != [self.laser.itemText(i) for i in range(self.laser.count())]:
            self.laser.blockSignals(True)
            self.laser.clear()
            self.laser.addItems(names)
            self.laser.blockSignals(False)
        self.laser.setVisible(len(names) > 1)
        self.pinned = None
        self.refresh()

    def _mark(self) -> None:
        """Follow the hovered scan line."""
        scan_line, shown, view = self.session.hovered, self.shown(), self.view
        self.rows.mark(scan_line)
        self.profile.mark(scan_line)
        parts, first = [], None
        for method, one in shown.items():
            for i in np.flatnonzero(one.points.index == (-1 if scan_line is None else scan_line))[:1]:
                error = float(error_values(one.errors, view)[i])
                depth = 1e3 * float(one.points.depth_z[i])
                said = f"{error:+.3g} {view.unit}" if math.isfinite(error) else "no truth here"
                parts.append(f"<span style='color:{method_colour(method)}'>●</span> {depth:.3f} mm ({said})")
                first = error if first is None and math.isfinite(error) else first
        self.histogram.mark(first)
        if scan_line is None:
            self.reading.setText("")
            return
        render = self.session.shown
        name = "Column" if render is not None and render.project.extraction.axis == "columns" else "Row"
        self.reading.setText(f"<b>{name} {scan_line}</b>&nbsp;&nbsp; {'&nbsp;&nbsp; '.join(parts) or 'no point'}")

    def _hover(self, scan_line: int | None) -> None:
        self.session.hover(self.pinned if scan_line is None else scan_line)

    def _pin(self, scan_line: int) -> None:
        self.pinned = None if scan_line == self.pinned else scan_line
        self.session.hover(scan_line)

    def _make_switches(self) -> None:
        """One button for each method of the render, in its colour."""
        render = self.session.shown
        wanted = [] if render is None else list(render.measurements)
        there = [item.widget() for i in range(self.switches.count()) if (item := self.switches.itemAt(i)) is not None]
        buttons = [button for button in there if button is not None]
        if wanted == [button.objectName() for button in buttons]:
            return
        for button in buttons:
            self.switches.removeWidget(button)
            button.deleteLater()
        for method in wanted:
            switch = QToolButton()
            switch.setObjectName(method)
            switch.setCheckable(True)
            switch.setChecked(method not in self.hidden)
            switch.setText(method_name(method))
            switch.setIcon(_dot(method_colour(method)))
            switch.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            switch.setToolTip("Show or hide this method")
            switch.toggled.connect(partial(self._switch, method))
            self.switches.addWidget(switch)

    def _switch(self, method: str, on: bool) -> None:
        self.hidden.discard(method) if on else self.hidden.add(method)
        self.refresh()

    def _repaint(self) -> None:
        for plot in (self.rows, self.profile, self.histogram):
            plot.repaint_theme()

    def _lay_out(self) -> None:
        bar = QHBoxLayout()
        truth = QLabel(f"<span style='color:{TRUTH}'>━</span> truth")
        for widget in (self.laser, self.error, truth):
            bar.addWidget(widget)
        bar.addLayout(self.switches)
        bar.addSpacing(12)
        bar.addWidget(self.reading, 1)
        tabs = QTabWidget()
        tabs.setDocumentMode(True)
        tabs.addTab(self.profile, "Profile")
        tabs.addTab(self.histogram, "Histogram")
        self.tabs = tabs
        across = QSplitter(Qt.Orientation.Horizontal)
        parts: list[tuple[QWidget, int]] = [(self.rows, 5), (tabs, 4), (self.table, 3)]
        for i, (part, stretch) in enumerate(parts):
            across.addWidget(part)
            across.setStretchFactor(i, stretch)
        across.setSizes([480, 380, 360])
        content = QWidget()
        inside = QVBoxLayout(content)
        inside.setContentsMargins(8, 6, 8, 8)
        inside.addLayout(bar)
        inside.addWidget(across, 1)
        nothing = QLabel(NOTHING, alignment=Qt.AlignmentFlag.AlignCenter, wordWrap=True)
        nothing.setObjectName("muted")
        self.stack = QStackedLayout(self)
        self.stack.addWidget(nothing)
        self.stack.addWidget(content)


def _measures_table() -> QTableWidget:
    made = QTableWidget()
    made.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
    made.setSelectionMode(QAbstractItemView.SelectionMode.ContiguousSelection)
    made.setShowGrid(False)
    made.setAlternatingRowColors(True)
    made.verticalHeader().setDefaultSectionSize(24)
    made.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
    made.setMinimumWidth(360)
    return made


def _fill(made: QTableWidget, methods: list[str], rows: list[tuple[str, str, list[float]]]) -> None:
    made.setColumnCount(len(methods))
    made.setRowCount(len(rows))
    made.setHorizontalHeaderLabels([method_name(method).replace(" ", "\n", 1) for method in methods])
    made.setVerticalHeaderLabels([f"{name} / {unit}" if unit else name for name, unit, _ in rows])
    for row, (_, _, values) in enumerate(rows):
        for column, value in enumerate(values):
            text = "-" if math.isnan(value) else f"{value:.0f}" if value == round(value) else f"{value:.3g}"
            item = QTableWidgetItem(text)
            item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            made.setItem(row, column, item)


def _dot(colour: str) -> QPixmap:
    from PySide6.QtGui import QPainter

    made = QPixmap(12, 12)
    made.fill(Qt.GlobalColor.transparent)
    painter = QPainter(made)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawEllipse(1, 1, 10, 10)
    painter.end()
    return made
