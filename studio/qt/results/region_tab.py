"""A range dragged in the row charts, the profile or the picture: what its errors come to, and its points as a table."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QPushButton, QTableWidgetItem, QVBoxLayout, QWidget

from analysis.report.colour import method_name
from render.base.errors import InputError
from studio.qt.core.dialogs import export_csv
from studio.qt.core.session import Session
from studio.qt.core.widgets import text_button
from studio.qt.results.measures_table import ReadOnlyTable
from studio.qt.results.plots import PointedPlots
from studio.qt.results.scan_bar import ScanBar
from studio.scan.height_map import points_of
from studio.scan.region import Box, Region, export_box, export_region, region_table, scan_table
from studio.scan.result_series import ErrorView
from studio.scan.stages import Measurement

HINT = (
    "Drag across the row charts or the profile, or with Shift over the picture, or press B in the 3D view and draw a "
    "rectangle about points: the errors of what lies within are told here. The edges can be moved in the charts; there "
    "Shift or the middle button shifts the view."
)
EXPLAINED = (
    "Value ± one sigma of chance: neighbouring scan lines that err alike count as one, by the predicted length of "
    "correlation or by the errors' own, whichever is longer."
)


class RegionTab(QWidget):
    """Of the region that was chosen last; `changed` when it is another one or none."""

    changed = Signal()

    def __init__(
        self,
        session: Session,
        rows: PointedPlots,
        profile: PointedPlots,
        scan_bar: ScanBar,
    ) -> None:
        """scan_bar: whether boxes are of all steps."""
        super().__init__()
        self.session, self.rows, self.profile = session, rows, profile
        self.region: Region | Box | None = None
        self._shown: dict[str, Measurement] = {}
        self._scan_bar, self._laser = scan_bar, 0
        self.title = QLabel(wordWrap=True)
        self.table = ReadOnlyTable()
        self.table.setToolTip(f"<p>{EXPLAINED}</p>")
        self.export: QPushButton = text_button("Export as CSV…", "The region's points, by every method shown")
        self.clear = text_button("Clear", "No region")
        buttons = QHBoxLayout()
        for button in (self.export, self.clear):
            buttons.addWidget(button)
        buttons.addStretch(1)
        column = QVBoxLayout(self)
        column.setContentsMargins(4, 6, 4, 0)
        column.addWidget(self.title)
        column.addWidget(self.table)
        column.addLayout(buttons)
        column.addStretch(1)
        self.export.clicked.connect(self._ask)
        self.clear.clicked.connect(lambda: self.choose(None))
        self._tell()

    def choose(self, region: Region | Box | None) -> None:
        """Mark it where it was dragged, and tell of it."""
        self.region = region
        if not isinstance(region, Region) or region.along != "scan lines":
            self.rows.hide_range()
            self.session.show_range(None)
        else:
            self.rows.show_range(region.low, region.high)
            self.session.show_range((region.low, region.high))
        if not isinstance(region, Region) or region.along != "fan":
            self.profile.hide_range()
        self._tell()
        self.changed.emit()
        panel = self.parentWidget()
        if region is not None and panel is not None and not panel.isVisible():
            self.session.message.emit("info", f"Measure, Region tells of {region.title}")

    def show_measurements(self, shown: dict[str, Measurement], view: ErrorView, laser: int) -> None:
        """By method, of one laser of the shown render."""
        self._shown, self._laser = shown, laser
        render, region = self.session.shown, self.region
        if render is None or region is None:
            return
        self._tell()
        scan = self._scan_bar.whole
        if isinstance(region, Box) and scan is not None:
            methods = scan.table(laser, view)[0][:1]
            rows = scan_table(region, scan.points, laser, view, scan.one_in)
        else:
            methods, rows = list(shown), region_table(region, list(shown.values()), render.project.scene, view)
        self.table.show_methods(methods, len(rows))
        for i, (name, texts) in enumerate(rows):
            self.table.setVerticalHeaderItem(i, QTableWidgetItem(name))
            for k, text in enumerate(texts):
                self.table.show_cell(i, k, text)
        self.table.end_with_rows()

    def write(self, path: Path) -> None:
        """InputError: there is nothing to write, or the file cannot be written."""
        render = self.session.shown
        scan, shown = self._scan_bar.whole, self._shown
        if isinstance(self.region, Box) and scan is not None:
            count = export_box(path, self.region, self._laser, points_of(scan.found.folder))
        elif render is None or self.region is None or not shown:
            raise InputError("no region is chosen", cure="drag across the profile first")
        else:
            count = export_region(path, self.region, shown, render.project.scene, self.session.document.root)
        methods = f" by {len(shown)} methods" if len(shown) > 1 and scan is None else ""
        self.session.message.emit("info", f"Wrote {path}: {count} points{methods}, {self.region.title}")

    def _of_which(self, region: Region | Box) -> str:
        """Of several lasers the one; of a scan: scan lines and places across the fan are of the step that is looked at,
        a box may be of all."""
        render = self.session.shown
        if render is None:
            return ""
        lasers = render.project.scene.lasers
        laser = f", of {lasers[self._laser].name}" if len(lasers) > 1 and self._laser < len(lasers) else ""
        if render.scan is None:
            return laser
        if isinstance(region, Box) and self._scan_bar.whole is not None:
            return f"{laser}, of all {render.scan.count} steps"
        return f"{laser}, of step {render.frame.step + 1} of {render.scan.count}"

    def _by_which(self, region: Region | Box) -> str:
        """Why a box shows one method, or by whose points it chooses the scan lines of all."""
        if not isinstance(region, Box):
            return ""
        if self._scan_bar.whole is not None:
            return ": a scan keeps the points of one method"
        first, *others = self._shown or ("",)
        return f": the scan lines whose points by {method_name(first)} lie in it" if others else ""

    def _ask(self) -> None:
        export_csv(self.window(), self.session, "region", "the region", self.write)

    def _tell(self) -> None:
        there = self.region is not None
        self.title.setText(
            HINT
            if self.region is None
            else f"<b>{self.region.title.capitalize()}{self._of_which(self.region)}</b>{self._by_which(self.region)}"
        )
        self.title.setObjectName("" if there else "muted")
        self.title.style().polish(self.title)
        for widget in (self.table, self.export, self.clear):
            widget.setVisible(there)
