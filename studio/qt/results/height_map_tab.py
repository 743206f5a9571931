"""The height map of the scan that is shown: its picture, the cells under the mouse, and a profile along a line."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF, QTimer
from PySide6.QtGui import QResizeEvent, QShowEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from analysis.height_map import HeightMap, along, encoded, height_map, within
from analysis.report.colour import method_colour
from render.base.arrays import Float
from render.base.errors import InputError
from render.output.tone_mapping import pyramid
from studio.editing.units import Unit
from studio.qt.core import theme
from studio.qt.core.dialogs import beside_project, show_trouble
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.core.widgets import ElidedLabel, text_button, upper_and_lower
from studio.qt.forms.unit_box import UnitBox
from studio.qt.image.image_item import PictureView
from studio.qt.results import plots
from studio.qt.viewport.colour_bar import ColourBar
from studio.runtime.error_messages import trouble
from studio.runtime.jobs import Job
from studio.scan.colour_scale import PER_METRE, ColourScale
from studio.scan.height_map import (
    file_range,
    left_out_record,
    left_out_sentence,
    picture,
    points_of,
    read_points,
    shown_range,
    sigma_record,
    sigma_sentence,
    steep_record,
    steep_sentence,
    write_made,
)
from studio.scan.scan_results import ScanResults

Range = tuple[float, float] | None
LANE = "height map"
NOTHING = "A height map is of a scan: run one (F6, Motion), or open the results of one."
FILES = "16 bit PNG (*.png);;16 bit TIFF (*.tif *.tiff)"
HINT = "Drag the line or its ends for another profile; the wheel zooms, a double click shows all."
REST_MS = 400
BAR_TIP = "Drag an end to another value; a double click brings back what was there. Right click: percentiles, mm or µm"
BAR_PX = 136
"""Beside the picture, for its colour bar."""
LEAST_PX, TOLD_PX = 360, 240
PROFILE_PX = 152
"""Height of the profile at which its axis has room for its name, and for more than one number."""


class HeightMapTab(QWidget):
    """Made when it is looked at, for as long as the same scan is shown."""

    made: HeightMap | None = None
    """As it is shown and written: the whole one, or without strays."""

    def __init__(self, session: Session, runner: JobRunner) -> None:
        super().__init__()
        self.session, self.runner = session, runner
        self.whole = self.made
        self._line = ""
        """What is told of the profile."""
        self._scan: ScanResults | None = None
        """Of which the map is, or will be."""
        self.scale = ColourScale(about_zero=False)
        self._first: tuple[float, float] | None = None
        """m, what colours show until a person says otherwise."""
        self.pitch = UnitBox(Unit.named("mm"), 0.0, 1000.0, 4, singleStep=0.05)
        self.pitch.setAccessibleName("Cells")
        self.pitch.setSpecialValueText("as many cells as points")
        self.pitch.setToolTip("Width of a cell")
        self._file_range: tuple[float, float] | None = None
        """m, what a file has of the heights."""
        self.all_heights = QCheckBox("All heights")
        self.all_heights.setToolTip(
            "Those of stray points too, in picture and file: they make the levels of the file coarser"
        )
        self.export = text_button(
            "Export…", "16 bit, with scale, offset and the value of no height in a file beside it"
        )
        self.view = PictureView()
        self.view.setToolTip(HINT)
        self.view.item.grid = False
        held = QWidget()
        row = QHBoxLayout(held)
        row.setContentsMargins(0, 0, BAR_PX, 0)
        row.addWidget(self.view)
        self.bar = ColourBar(held)
        self.bar.setToolTip(BAR_TIP)
        self.line = pg.LineSegmentROI([(0.0, 0.0), (1.0, 0.0)])
        self.view.box.addItem(self.line, ignoreBounds=True)
        self.graph = pg.GraphicsLayoutWidget()
        self.plot = plots.new_plot("Along the line / mm", "Height", "mm")
        self.graph.addItem(self.plot)
        self.graph.setMinimumHeight(PROFILE_PX)
        self.profile = plots.curve(method_colour("likelihood"))
        self.plot.addItem(self.profile)
        self.read = ElidedLabel()
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        self.told.setMinimumWidth(TOLD_PX)
        self.split = upper_and_lower(held, self.graph, (300, 140))
        self.split.setMinimumHeight(LEAST_PX)
        # what scrolls is as high as it asks for: the pictures ask for next to nothing, and take what there is
        self.split.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Ignored)
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self.make)
        self._lay_out()
        self.pitch.refused.connect(partial(session.message.emit, "warning"))
        self.pitch.valueChanged.connect(lambda _: self._rest.start())
        self.export.clicked.connect(self._ask)
        self.all_heights.toggled.connect(lambda: self._take(self.whole))
        self.bar.scaled.connect(self._rescale)
        self.bar.unit_chosen.connect(self._draw)
        self.line.sigRegionChanged.connect(self._show_profile)
        self._hover = pg.SignalProxy(self.view.scene().sigMouseMoved, rateLimit=30, slot=self._moved)
        self.view.scene().sigMouseClicked.connect(lambda event: self.view.fit() if event.double() else None)
        runner.failed.connect(self._tell_failure)
        theme.notice.changed.connect(self._repaint)
        for signal in (session.renders_changed, session.measured):
            signal.connect(self.refresh)
        self._repaint()
        self.refresh()

    def refresh(self) -> None:
        """Another scan is shown, or none: its map is made when the tab is looked at."""
        render = self.session.shown
        scan = None if render is None or render.scan is None or not render.scan.measured else render.scan
        if scan is not None and scan is self._scan:
            return
        self._scan = scan
        self._take(None)
        self.told.setText(NOTHING if scan is None else "")
        self.pitch.setEnabled(scan is not None)
        if self.isVisible():
            self.make()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self.made is None:
            self._rest.start(0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()

    def _make_room(self) -> None:
        """A layout knows of a text's lines only where it is as wide as it asks for: else it lies over the profile."""
        self.told.setMinimumHeight(max(0, self.told.heightForWidth(self.told.width())))

    def make(self) -> None:
        """In the background; the last pitch counts."""
        scan = self._scan
        if scan is None:
            return
        folder, pitch = scan.found.folder, 1e-3 * self.pitch.value() or None
        self.told.setText("Making the height map…")

        def work(progress: object, cancelled: object) -> tuple[HeightMap, Range]:
            points = read_points(points_of(folder))
            return height_map(points, pitch), file_range(points)

        def then(made: tuple[HeightMap, Range]) -> None:
            if scan is self._scan:
                self._file_range = made[1]
                self._take(made[0])

        self.runner.run(LANE, "height map", work, then)

    def write(self, path: Path) -> None:
        """InputError: there is no map, or as of `write_made`."""
        if self.whole is None or self._scan is None:
            raise InputError("there is no height map yet")
        written = write_made(self.whole, path, points_of(self._scan.found.folder), self._limits())
        left_out = left_out_sentence(written.record["left_out"])
        text = f"Wrote {', '.join(str(file) for file in written.paths)}"
        self.session.message.emit("warning" if left_out else "info", f"{text}. {left_out}" if left_out else text)

    def _limits(self) -> Range:
        """Of the heights that a file has; None: all."""
        return None if self.all_heights.isChecked() else self._file_range

    def _take(self, whole: HeightMap | None) -> None:
        before, self.whole = self.made, whole
        try:
            kept = None if whole is None else within(whole, self._file_range)
        except InputError:  # nothing else there
            kept = whole
        made = self.made = whole if self.all_heights.isChecked() else kept
        # colours are those of the part, also where strays are shown
        self._first = None if kept is None else shown_range(kept)
        self.split.setVisible(made is not None)
        self.read.setVisible(made is not None)
        self.export.setEnabled(made is not None)
        self.all_heights.setEnabled(made is not None)
        if made is None:
            return
        self._draw()
        self._tell()
        rows, columns = made.heights.shape
        if before is None or before.heights.shape != made.heights.shape:
            self.view.fit()
            middle, edge = 0.5 * (rows - 1), 0.1 * (columns - 1)
            for handle, column in zip(self.line.getHandles(), (edge, columns - 1 - edge), strict=True):
                self.line.movePoint(handle, (column, middle), coords="parent")
        self._show_profile()

    def _tell(self) -> None:
        made, whole = self.made, self.whole
        if made is None or whole is None:
            return
        rows, columns = made.heights.shape
        size = f"{columns} x {rows} cells of {1e3 * made.pitch:.4g} mm of {made.points} points, "
        share = f"{np.isfinite(made.heights).mean():.1%} with a height"
        texts = [size + share]
        if np.isfinite(made.heights).any():
            low, high = 1e3 * np.nanmin(made.heights), 1e3 * np.nanmax(made.heights)
            texts.append(f"Heights from {low:.4g} to {high:.4g} mm")
            texts.append(left_out_sentence(left_out_record(whole, made)))
            texts.append(steep_sentence(steep_record(made)))
            texts.append(sigma_sentence(sigma_record(made, encoded(made.heights)[1])).replace(" um", " µm"))
        self.told.setText("\n".join(filter(None, texts)))
        self._make_room()

    def _draw(self) -> None:
        if self.made is None:
            return
        unit = self.bar.unit_of("map")
        factor = PER_METRE[unit]
        first = None if self._first is None else (factor * self._first[0], factor * self._first[1])
        limits = self.bar.show_scale("Height", unit, self.scale, factor * self.made.heights.ravel(), first=first)
        low, high = (1e3 / factor * limit for limit in limits)
        rows, columns = self.made.heights.shape
        self.view.item.set_levels(pyramid(picture(self.made, self.scale, (low, high))), (columns, rows))

    def _rescale(self, scale: ColourScale) -> None:
        self.scale = scale
        self._draw()

    def _show_profile(self) -> None:
        if self.made is None:
            return
        ends = [self.line.mapToParent(handle.pos()) for handle in self.line.getHandles()]
        start, end = ((point.x(), point.y()) for point in ends)
        distance, height = along(self.made, start, end)
        self.profile.setData(1e3 * distance, 1e3 * height)
        self.plot.enableAutoRange()
        self._line = line_sentence(distance, height)
        self.read.setText(self._line)

    def _moved(self, event: tuple[QPointF]) -> None:
        """Tell the cell under the mouse."""
        made = self.made
        if made is None:
            return
        where = self.view.box.mapSceneToView(event[0])
        column, row = round(where.x()), round(where.y())
        rows, columns = made.heights.shape
        if not (0 <= row < rows and 0 <= column < columns):
            self.read.setText(self._line)
            return
        x, y = made.x + column * made.pitch, made.y - row * made.pitch
        z = float(made.heights[row, column])
        told = f"z {1e3 * z:.4f} mm" if math.isfinite(z) else "no surface here"
        self.read.setText(f"x {1e3 * x:.3f} mm   y {1e3 * y:.3f} mm   {told}")

    def _tell_failure(self, job: Job[object]) -> None:
        if job.name == LANE and job.problem is not None:
            self.told.setText(job.problem.text)

    def _repaint(self) -> None:
        c = theme.colours()
        for widget in (self.view, self.graph):
            widget.setBackground(c.base)
        plots.paint(self.plot)
        self.line.setPen(pg.mkPen(c.accent, width=2))
        self.line.hoverPen = pg.mkPen(c.accent, width=3)
        self._show_profile()

    def _ask(self) -> None:
        start = beside_project(self.session, "height map.png")
        chosen, kind = QFileDialog.getSaveFileName(self.window(), "Export", start, FILES)
        if not chosen:
            return
        path = Path(chosen)
        self.session.chose(path)
        if not path.suffix:
            path = path.with_name(path.name + (".tif" if "TIFF" in kind else ".png"))
        try:
            self.write(path)
        except InputError as error:
            show_trouble(self.window(), trouble(error, "export the height map"))

    def _lay_out(self) -> None:
        form = QFormLayout()
        row = QHBoxLayout()
        row.addWidget(self.pitch, 1)
        row.addWidget(self.export)
        row.addWidget(self.all_heights)
        form.addRow("Cells", row)
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 8)
        column.addLayout(form)
        column.addWidget(self.split, 1)
        column.addWidget(self.read)
        column.addWidget(self.told)
        column.addStretch(0)


def line_sentence(distance: Float, height: Float) -> str:
    """How long a line across the map is, and by how much its ends differ; m, heights NaN where there is no surface."""
    told = f"Line of {1e3 * distance[-1]:.3f} mm"
    (known,) = np.nonzero(np.isfinite(height))
    if len(known) < 2:
        return told
    first, last = known[0], known[-1]
    differ = f"{1e3 * (height[last] - height[first]):+.4f} mm"
    if first == 0 and last == len(height) - 1:
        return f"{told}, its ends differ by {differ}"
    between = f"{1e3 * (distance[last] - distance[first]):.3f} mm"
    return f"{told}, its first and last height, {between} apart, differ by {differ}"
