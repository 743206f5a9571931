"""One scan line of the developed image: its pixels, the fitted profile of each method, and where the line truly is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QCheckBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from analysis.line.methods.line_profile import profile
from analysis.line.result import Flag, Line
from analysis.report.colour import TRUTH, method_colour, method_name
from render.base.arrays import Float
from render.frame import LaserCurve
from render.sensor.develop import Image
from studio.qt.core import theme
from studio.qt.core.boxes import WholeBox
from studio.qt.core.session import Session
from studio.scan.stages import Measurement

MARGIN_PX = 14.0
"""Shown on either side of the line, beside three times its width."""
REASONS = {
    Flag.NO_PEAK: "nothing as wide as a line stands out of noise and background",
    Flag.AT_BORDER: "cut by the border",
    Flag.TOO_FEW_PIXELS: "too few pixels",
    Flag.NOT_CONVERGED: "fit did not converge",
    Flag.OUT_OF_WINDOW: "fit left its window",
    Flag.TOO_WIDE: "what stands out most is too wide for a line",
    Flag.NO_PIXELS: "no usable pixel",
}
CAUTIONS = {
    Flag.SATURATED: "saturated",
    Flag.UNRESOLVED: "narrower than its pixels",
    Flag.BLENDED: "more than one line, or one on texture or at an edge",
    Flag.MISFIT: "not the profile of a line",
    Flag.SPECKLED: "made up of few speckle grains",
}


def scan_line(image: Image, axis: str, index: int) -> NDArray[Any]:
    """(n,) DN of a row or column; of a photograph in colour the mean of its channels."""
    return image.grey[index] if axis == "rows" else image.grey[:, index]


def fitted_profile(line: Line, index: int, image: Image, x: Float, integrated: bool) -> list[Float]:
    """DN at positions x (n,) px of every peak that was fitted on a scan line; centre of mass has no profile.

    None of a photograph either, whose numbers are no electrons times a gain.

    integrated: over a pixel centred at x, as the fit had it, so that the curve meets the pixels at their centres.
    """
    if line.method == "centre_of_mass" or image.processed:
        return []
    found = []
    for rank in np.flatnonzero(line.valid[index]):
        shape = np.empty((3, len(x)))
        profile(x, len(x), line.u[index, rank], line.width[index, rank], integrated, shape)
        electrons = line.background[index, rank] + line.amplitude[index, rank] * shape[0]
        found.append(np.minimum(image.gain * electrons + image.black_level, image.saturation))
    return found


class RowProfile(QWidget):
    """Follows the hovered scan line; the box moves it by keys."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.laser = 0
        self.plot = pg.PlotWidget()
        self.plot.setMenuEnabled(False)
        self.plot.hideButtons()
        self.plot.setLabel("bottom", "position along the scan line, px")
        self.plot.setLabel("left", "DN")
        for side in ("left", "bottom"):
            self.plot.getAxis(side).enableAutoSIPrefix(False)
        self.plot.getPlotItem().getViewBox().setMouseEnabled(x=True, y=False)
        self.pixels = pg.PlotCurveItem([0, 1], [0], stepMode="center", fillLevel=0)
        self.plot.addItem(self.pixels)
        self._marks: list[Any] = []
        self._top = 0.0
        self.row = WholeBox(maximum=0)
        self.row.setKeyboardTracking(False)
        self.row.setPrefix("row ")
        self.follow = QCheckBox("follow the line")
        self.follow.setToolTip("Keep the line in the middle; off: keep what is zoomed to.")
        self.follow.setChecked(True)
        self.text = QLabel(wordWrap=True)
        self.text.setObjectName("muted")
        bar = QHBoxLayout()
        bar.setContentsMargins(6, 2, 6, 0)
        for widget in (self.row, self.follow):
            bar.addWidget(widget)
        bar.addWidget(self.text, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(self.plot, 1)
        self.row.valueChanged.connect(session.hover)
        self.follow.toggled.connect(lambda on: self.refresh())
        session.hover_changed.connect(self.refresh)
        for signal in (session.developed, session.measured, session.renders_changed):
            signal.connect(self.refresh)
        session.project_changed.connect(self._follow_project)
        session.document_replaced.connect(self._start_anew)
        self._anew = True
        """Nothing was zoomed to in this project."""
        self._as_it_was = False
        """The scene has changed since what is shown."""
        self._colour()
        self.refresh()

    def _follow_project(self) -> None:
        if self.session.stale != self._as_it_was:
            self.refresh()

    def _start_anew(self) -> None:
        self._anew = True

    def show_laser(self, laser: int) -> None:
        """Whose image it is."""
        if laser != self.laser:
            self.laser = laser
            self.refresh()

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "pixels"):
            self._colour()
        super().changeEvent(event)

    def _colour(self) -> None:
        colours = theme.colours()
        self.plot.setBackground(colours.base)
        for side in ("left", "bottom"):
            axis = self.plot.getAxis(side)
            axis.setPen(colours.line)
            axis.setTextPen(colours.muted)
        self.pixels.setPen(pg.mkPen(colours.muted, width=1))
        self.pixels.setBrush(pg.mkBrush(theme.mixed(colours.muted, colours.base, 0.25)))

    def refresh(self) -> None:
        """Show the scan line that is hovered, else the one in the middle of the line."""
        render = self.session.shown
        for mark in self._marks:
            self.plot.removeItem(mark)
        self._marks.clear()
        if render is None or self.laser >= len(render.images):
            self.pixels.hide()
            self.row.setEnabled(False)
            self.text.setText("the profile of a scan line comes with a render" if render is None else "developing")
            return
        curve = render.frame.curves[self.laser] if self.laser < len(render.frame.curves) else None
        image = render.images[self.laser]
        axis = curve.axis if curve is not None else render.project.extraction.axis
        count = image.pixels.shape[0 if axis == "rows" else 1]
        index = self._index(curve, count)
        self._show_box(axis, count, index)
        values = scan_line(image, axis, index)
        self.pixels.show()
        self.pixels.setData(np.arange(len(values) + 1) - 0.5, values.astype(np.float64), stepMode="center")
        self.pixels.setFillLevel(image.black_level)
        true = curve.position[curve.index == index] if curve is not None else np.zeros(0)
        for position in true:
            self._mark(position, TRUTH, 1.6)
        lines = self._measured(index)
        told, places = [f"true {p:.3f}" for p in true], list(true)
        self._top = 0.0
        for method, item in lines.items():
            told.append(self._show_method(method, item, index, image, true))
            places += list(item.line.u[index][item.line.valid[index]])
        self._as_it_was = self.session.stale
        before = ["<i>in the scene as it was rendered:</i>"] if self._as_it_was else []
        self.text.setText("   ".join([*before, *told]) if told else "no line here")
        if self.follow.isChecked() or self._anew:
            self._anew = False
            self._look_at(places, lines, index, values, image)

    def _index(self, curve: LaserCurve | None, count: int) -> int:
        hovered = self.session.hovered
        if hovered is None:
            middle = len(curve.index) // 2 if curve is not None else 0
            hovered = int(curve.index[middle]) if curve is not None and len(curve.index) else count // 2
        return min(max(hovered, 0), count - 1)

    def _show_box(self, axis: str, count: int, index: int) -> None:
        self.row.setEnabled(True)
        self.row.blockSignals(True)
        self.row.setPrefix("row " if axis == "rows" else "column ")
        self.row.setMaximum(count - 1)
        self.row.setValue(index)
        self.row.blockSignals(False)

    def _measured(self, index: int) -> dict[str, Measurement]:
        render = self.session.shown
        found: dict[str, Measurement] = {}
        if render is not None:
            for method, by_laser in render.measurements.items():
                if self.laser < len(by_laser) and index < len(by_laser[self.laser].line.u):
                    found[method] = by_laser[self.laser]
        return found

    def _show_method(self, method: str, item: Measurement, index: int, image: Image, true: Float) -> str:
        """Marks and curve of one method; returns what to say about it."""
        line, colour = item.line, method_colour(method)
        for u in line.u[index][line.valid[index]]:
            self._mark(u, colour, 1.4, dashed=True)
        valid = np.flatnonzero(line.valid[index])
        if not len(valid):
            reason = REASONS.get(Flag(int(line.flag[index, 0])), "no position")
            return f"<span style='color:{colour}'>●</span> {method_name(method)} finds no line: {reason}"
        u, width = float(line.u[index, valid[0]]), float(line.width[index, valid[0]])
        if np.isfinite(width):
            x = np.linspace(u - 5 * width, u + 5 * width, 201)
            integrated = self.session.project.extraction.profile == "integrated"
            for y in fitted_profile(line, index, image, x, integrated)[:1]:
                self._add(pg.PlotCurveItem(x, y, pen=pg.mkPen(colour, width=1.6)))
                self._top = max(self._top, float(y.max()))
        off = round(u - float(true[np.argmin(np.abs(true - u))]), 3) if len(true) else 0.0
        # what is found and has no truth may be of a line all the same, as beside an edge
        error = f" {off + 0.0:+.3f} px" if len(true) else f" {u:.3f} px, no truth here to compare with"
        caution = CAUTIONS.get(Flag(int(line.flag[index, valid[0]])), "")
        return f"<span style='color:{colour}'>●</span> {method_name(method)}{error}{caution and f', {caution}'}"

    def _mark(self, position: float, colour: str, width: float, dashed: bool = False) -> None:
        style = pg.QtCore.Qt.PenStyle.DashLine if dashed else pg.QtCore.Qt.PenStyle.SolidLine
        self._add(pg.InfiniteLine(float(position), angle=90, pen=pg.mkPen(colour, width=width, style=style)))

    def _add(self, item: Any) -> None:
        self._marks.append(item)
        # what is fitted must not decide the range
        self.plot.addItem(item, ignoreBounds=True)

    def _look_at(
        self, places: list[float], lines: dict[str, Measurement], index: int, values: NDArray[Any], image: Image
    ) -> None:
        widths = [float(np.nanmax(item.line.width[index], initial=0.0)) for item in lines.values()]
        margin = MARGIN_PX + 3.0 * max([*widths, 0.0])
        centre = places[0] if places else len(values) / 2
        low, high = (min([*places, centre]) - margin, max([*places, centre]) + margin) if places else (0, len(values))
        inside = values[max(0, int(low)) : int(high) + 2]
        top = max(
            float(inside.max(initial=0)), self._top, image.black_level + 0.02 * (image.saturation - image.black_level)
        )
        self.plot.setXRange(low, high, padding=0.0)
        self.plot.setYRange(image.black_level, image.black_level + 1.12 * (top - image.black_level), padding=0.0)
