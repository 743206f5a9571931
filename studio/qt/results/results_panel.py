"""The results of the shown render: line, depth and error by scan line, profile, histogram, measures, all linked.

Of a scan they are of the step that is looked at; the measures and the histogram of all its steps, where asked for.
"""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QScrollArea,
    QSizePolicy,
    QSplitter,
    QStackedLayout,
    QTabWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from analysis.report.colour import TRUTH, method_colour, method_name
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.figures_age import FiguresAge
from studio.qt.core.icons import dot
from studio.qt.core.laser_box import LaserBox
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session, one_of
from studio.qt.results.head_row import HeadRow
from studio.qt.results.heads import heads, measured_otherwise
from studio.qt.results.measures_table import MeasuresTable
from studio.qt.results.nothing_yet import NothingYet
from studio.qt.results.part_tab import PartTab
from studio.qt.results.region_tab import RegionTab
from studio.qt.results.remarks_list import Remarks
from studio.qt.results.results_histogram import ErrorHistogram
from studio.qt.results.results_profile import ProfilePlot
from studio.qt.results.results_rows import RowPlots
from studio.qt.results.results_steps import StepsPlot
from studio.qt.results.scan_bar import ScanBar
from studio.qt.results.scan_line_reading import NOTHING, UNMEASURED, reading
from studio.scan.region import Box, Region, scan_errors
from studio.scan.remarks import frame_remarks, scale_notes
from studio.scan.result_series import ERROR_VIEWS, ErrorView, error_values, measured_series, table, true_series
from studio.scan.scan_results import COLUMNS, ScanResults
from studio.scan.stages import Measurement

BY_STEP_ONLY = "The scan's files hold this error in sum only; choose Figures of this step"
AS_SCANNED = "All steps are as they were scanned; what changed since in exposure or extraction is in this step's."
STEPS, NOTICE = 2, 3
"""Tabs of the plots."""
PART, REGION = 1, 2
"""Tabs of the figures."""
LEAST = 90
"""px of height of the figures: what has no room scrolls."""
TALL = 480
"""px of height from which there is room below the measures."""


class ResultsPanel(QWidget):
    """Follows `session.shown`; hovering any plot hovers the scan line everywhere, a click keeps it."""

    view_changed = Signal(object)
    """Another `ErrorView` was chosen."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.pinned: int | None = None
        self._drawn: tuple[object, ...] = ()
        self.scan_lines: tuple[str, int, int] | None = None
        self.hidden: set[str] = set()
        """Methods that are switched off."""
        self.laser = LaserBox(session)
        self.laser.setToolTip("The laser that points, errors and measures are of")
        self.error = ChoiceBox()
        self.error.addItems([view.title for view in ERROR_VIEWS])
        self.error.setToolTip(
            "Which error plots, histogram and table show: measured minus true; of depth and surface positive is too "
            "far from the camera"
        )
        self.switches = QHBoxLayout()
        self.switches.setSpacing(2)
        self.reading = QLabel()
        self.reading.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.reading.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.rows, self.profile, self.histogram, self.by_step = RowPlots(), ProfilePlot(), ErrorHistogram(), StepsPlot()
        self.table = MeasuresTable()
        self.scan_bar = ScanBar(session)
        self.part = PartTab(session, self.profile, self.scan_bar)
        self.region = RegionTab(session, self.rows, self.profile, self.scan_bar)
        self.scan_steps = scan_steps(session)
        self.top, self._growing = HeadRow(self.scan_bar), False
        self.head, self.head_text = self.top.banner, self.top.banner.text
        self.notices = Remarks(), Remarks()
        """What a reader should notice: below the measures, and in a tab where there is no room below them."""
        self._lay_out()
        self.laser.chosen.connect(self.refresh)
        self.error.currentIndexChanged.connect(self.refresh)
        self.error.currentIndexChanged.connect(lambda _: self.view_changed.emit(self.view))
        for plot in (self.rows, self.profile):
            plot.hovered.connect(self._hover)
            plot.chosen.connect(self.pin)
        for ranged in (self.rows.ranged, session.range_dragged):
            ranged.connect(lambda low, high: self.choose(Region("scan lines", low, high)))
        self.profile.ranged.connect(
            lambda low, high: self.choose(Region("fan", 1e-3 * low, 1e-3 * high, self.profile.section))
        )
        self.region.changed.connect(self._show_region)
        self.part.placing_changed.connect(lambda: self.figures.setCurrentIndex(PART))
        self.by_step.chosen.connect(session.look_at_step)
        self.scan_bar.scope_changed.connect(self.refresh)
        self.scan_steps.told.connect(self._tell_head)
        one_of(FiguresAge, session).changed.connect(self._tell_head)
        session.renders_changed.connect(self._another_render)
        session.project_changed.connect(self._project_changed)
        session.step_changed.connect(lambda: self.by_step.mark(session.step))
        session.step_changed.connect(self._tell_head)
        session.measured.connect(self.refresh)
        session.hover_changed.connect(self._mark)
        theme.notice.changed.connect(self._repaint)
        self._another_render()
        self._repaint()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.scan_steps.close()
        super().closeEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_remarks()

    @property
    def view(self) -> ErrorView:
        return ERROR_VIEWS[self.error.currentIndex()]

    def shown(self) -> dict[str, Measurement]:
        """Measurements of the chosen laser by the methods that are switched on."""
        render, laser = self.session.shown, self.laser.laser
        if render is None:
            return {}
        found = {method: each[laser] for method, each in render.measurements.items() if laser < len(each)}
        return {method: one for method, one in found.items() if method not in self.hidden}

    def refresh(self) -> None:
        """Draw everything anew."""
        render, laser = self.session.shown, self.laser.laser
        self._drawn = self._inputs()
        self._make_switches()
        have = render is not None and laser < len(render.frame.curves)
        self.stack.setCurrentIndex(1 if have else 0)
        if render is None or not have:
            return
        scene, shown, view = render.project.scene, self.shown(), self.view
        curve = render.frame.curves[laser]
        section = self.session.project.measured_in
        truth = true_series(curve, scene, laser, render.frame.step, section)
        series = {method: measured_series(one, scene, section) for method, one in shown.items()}
        errors = {method: error_values(one.errors, view) for method, one in shown.items()}
        self.rows.count = render.frame.shape[0 if curve.axis == "rows" else 1]
        self.rows.show_series(curve.axis, truth, {method: (series[method], errors[method]) for method in shown}, view)
        self.profile.show_series(truth, series, section)
        self.part.follow(laser)
        self.region.show_measurements(shown, view, laser)
        if (whole := self.scan_bar.whole) is not None:
            self._show_all_steps(whole, laser)
            remarks = whole.remarks()
            if measured_otherwise(self.session, render):
                remarks.insert(0, AS_SCANNED)
        else:
            self._show_histogram()
            self.table.show_measures(list(shown), table(list(shown.values()), view))
            found, doubts = render.measurements, render.doubts
            remarks = frame_remarks(render.measured_as, render.frame, found, doubts) if found else []
        self._show_by_step(render.scan, laser)
        self._tell_remarks(list(dict.fromkeys([*scale_notes(render.scanner_scale), *remarks])))
        self._tell_head()
        self._mark()

    def _show_region(self) -> None:
        """Another region was chosen, or none."""
        self.region.show_measurements(self.shown(), self.view, self.part.laser)
        if (whole := self.scan_bar.whole) is not None:
            self._show_all_steps(whole, self.part.laser)
        else:
            self._show_histogram()
            self._mark()

    def _show_histogram(self) -> None:
        """Of the shown frame, or of a region of it."""
        render, region, view = self.session.shown, self.region.region, self.view
        errors = {method: error_values(one.errors, view) for method, one in self.shown().items()}
        if render is not None and region is not None:
            within = {method: region.of(one, render.project.scene) for method, one in self.shown().items()}
            errors = {method: error[within[method]] for method, error in errors.items()}
        self.histogram.show_errors(errors, view, "" if region is None else f"Of {region.title}")

    def _show_all_steps(self, scan: ScanResults, laser: int) -> None:
        """Measures and histogram of a whole scan; its points are of the first method alone."""
        view = self.view
        methods, rows = scan.table(laser, view)
        kept = [i for i, method in enumerate(methods) if method not in self.hidden]
        of_kept = [(name, unit, [values[i] for i in kept]) for name, unit, values in rows]
        self.table.show_measures([methods[i] for i in kept], of_kept)
        if view.kind not in COLUMNS:
            self.histogram.show_errors({}, view, BY_STEP_ONLY)
            return
        region = self.region.region if isinstance(self.region.region, Box) else None
        errors = {methods[0]: scan_errors(region, scan.points, laser, view)} if kept[:1] == [0] else {}
        self.histogram.show_errors(errors, view, "" if region is None else f"Of {region.title}")

    def _show_by_step(self, scan: ScanResults | None, laser: int) -> None:
        self.tabs.setTabVisible(STEPS, scan is not None and scan.measured)
        if scan is not None and scan.measured:
            view, (methods, _) = self.view, scan.table(laser, self.view)
            bias, rmse = scan.by_step(laser, view.kind)
            title = "RMSE, and dashed the mean error" if view.kind in COLUMNS else BY_STEP_ONLY
            self.by_step.show_steps(methods[0] if methods else "", view.scale * bias, view.scale * rmse, view, title)
            self.by_step.mark(self.session.step)

    def _tell_remarks(self, remarks: list[str]) -> None:
        """What a reader should notice, as the report has it."""
        self.tabs.setTabText(NOTICE, f"Worth noticing ({len(remarks)})" if remarks else "Worth noticing")
        for notice in self.notices:
            notice.show_texts(remarks)

    def _tell_head(self) -> None:
        self.top.tell(heads(self.session, self.scan_steps.problem, self._growing))

    def tell_growing(self, growing: bool) -> None:
        """The points in the 3D view are of a scan that is not shown here."""
        self._growing = growing
        self._tell_head()

    def _project_changed(self) -> None:
        if self.session.project.measured_in != self.profile.section:
            if isinstance(region := self.region.region, Region) and region.along == "fan":
                self.region.choose(None)  # other points lie there in another section
            self.refresh()
        else:
            self._tell_head()

    def _another_render(self) -> None:
        render = self.session.shown
        names = [] if render is None else [laser.name for laser in render.project.scene.lasers]
        self.laser.show_names(names)
        before, self.scan_lines = self.scan_lines, None if render is None else render.scan_lines
        if self.scan_lines != before:
            self.pinned = None
            self.region.choose(None)
        self.scan_bar.follow()
        # of light that joins a render nothing is drawn before it is measured
        self._tell_head() if list(map(id, self._inputs())) == list(map(id, self._drawn)) else self.refresh()

    def _inputs(self) -> tuple[object, ...]:
        render = self.session.shown
        return self.scan_bar.whole, render, render and render.frame.curves, render and render.measurements

    def _mark(self) -> None:
        """Follow the hovered scan line."""
        scan_line, shown, view = self.session.hovered, self.shown(), self.view
        self.rows.mark(scan_line)
        self.profile.mark(scan_line)
        axis = "" if self.scan_lines is None else self.scan_lines[0]
        render = self.session.shown
        text, first = reading(scan_line, shown, view, axis, NOTHING if render and render.measurements else UNMEASURED)
        self.histogram.mark(first)
        self.reading.setText(text)

    def _hover(self, scan_line: int | None) -> None:
        self.session.hover(self.pinned if scan_line is None else scan_line)

    def pin(self, scan_line: int) -> None:
        """Keep a scan line marked; the same one again lets it go."""
        self.pinned = None if scan_line == self.pinned else scan_line
        self.session.hover(scan_line)

    def give_up(self) -> bool:
        """Escape: no measure is added after all; False: none was being added."""
        adding = self.part.placing is not None
        self.part.cancel()
        return adding

    def choose(self, region: Region | Box) -> None:
        """A range was dragged: of the measure that is being added, else to be told of."""
        if self.part.placing is None:
            self.region.choose(region)
            self.figures.setCurrentIndex(REGION)
            return
        self.region.choose(None)
        render = self.session.shown
        found = next(iter(self.shown().values()), None)
        across = (
            None
            if render is None or found is None
            else region.across(found, render.project.scene, self.profile.section)
        )
        if across is None:
            self.session.message.emit("warning", f"No points within {region.title}: drag where the profile is")
        else:
            self.part.place(*across)

    def _make_switches(self) -> None:
        """One button for each method of the render, in its colour."""
        render = self.session.shown
        if render is not None and not render.measurements:
            return  # it is about to be measured: those of the render before may stay
        wanted = [] if render is None else list(render.measurements)
        there = [item.widget() for i in range(self.switches.count()) if (item := self.switches.itemAt(i)) is not None]
        buttons = [button for button in there if button is not None]
        if wanted == [button.objectName() for button in buttons]:
            return
        for button in buttons:
            self.switches.removeWidget(button)
            button.hide()
            button.deleteLater()
        for method in wanted:
            switch = QToolButton()
            switch.setObjectName(method)
            switch.setCheckable(True)
            switch.setChecked(method not in self.hidden)
            switch.setText(method_name(method))
            switch.setIcon(dot(method_colour(method)))
            switch.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            switch.setToolTip("Show or hide this method")
            switch.toggled.connect(partial(self._switch, method))
            self.switches.addWidget(switch)

    def _switch(self, method: str, on: bool) -> None:
        self.hidden.discard(method) if on else self.hidden.add(method)
        self.refresh()

    def _place_remarks(self) -> None:
        tall = self.height() >= TALL
        self.notices[0].setVisible(tall)
        self.tabs.setTabVisible(NOTICE, not tall)

    def _repaint(self) -> None:
        for plot in (self.rows, self.profile, self.histogram, self.by_step):
            plot.repaint_theme()
        self.head.repaint_theme()
        self.refresh()

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
        tabs.addTab(self.by_step, "Steps")
        tabs.addTab(self.notices[1], "Worth noticing")
        self.tabs = tabs
        across = QSplitter(Qt.Orientation.Horizontal)
        measures = QWidget()
        column = QVBoxLayout(measures)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.table, 2)
        column.addWidget(self.notices[0], 1)
        column.addStretch(0)
        self.figures = QTabWidget()
        self.figures.setDocumentMode(True)
        self.figures.addTab(measures, "Errors")
        scrolled = QScrollArea(widgetResizable=True)
        scrolled.setFrameShape(QFrame.Shape.NoFrame)
        scrolled.setWidget(self.part)
        self.figures.addTab(scrolled, "Measures of the part")
        self.figures.addTab(self.region, "Region")
        self.figures.setMinimumHeight(LEAST)
        parts: list[tuple[QWidget, int]] = [(self.rows, 5), (tabs, 4), (self.figures, 3)]
        for i, (part, stretch) in enumerate(parts):
            across.addWidget(part)
            across.setStretchFactor(i, stretch)
        across.setSizes([430, 350, 440])
        content = QWidget()
        inside = QVBoxLayout(content)
        inside.setContentsMargins(8, 6, 8, 8)
        inside.addWidget(self.top)
        inside.addLayout(bar)
        inside.addWidget(across, 1)
        self.stack = QStackedLayout(self)
        self.stack.addWidget(NothingYet(self.session))
        self.stack.addWidget(content)
