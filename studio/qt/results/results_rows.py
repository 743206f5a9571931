"""The three panels of the founding paper: line position, depth, and error of the depth, by scan line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF

from analysis.report.colour import TRUTH, method_colour
from render.base.arrays import Float
from studio.qt.core import theme
from studio.qt.results import plots
from studio.scan.first_range import Column, line_range
from studio.scan.result_series import ErrorView, Series, readable_unit

REACH_PX = 6.0
"""From the mouse, of a dot that it is at."""


class RowPlots(plots.PointedPlots):
    """Stacked plots with one scan-line axis."""

    def __init__(self) -> None:
        self.position = plots.new_plot("", "Position", "px", plots.RangeBox())
        self.depth = plots.new_plot("", "Depth", "mm", plots.RangeBox())
        self.error = plots.new_plot("Row", "Error", "µm", plots.RangeBox())
        super().__init__(self.position, self.depth, self.error)
        for plot in (self.position, self.depth):
            plot.setXLink(self.error)
            plot.getAxis("bottom").setStyle(showValues=False)
        self.ci.layout.setSpacing(2)
        self.cursors = [plots.cursor(plot) for plot in self.plots]
        self.zero = pg.InfiniteLine(angle=0, pos=0.0)
        self.error.addItem(self.zero, ignoreBounds=True)
        self.rings = [plots.ring() for _ in self.plots]
        for plot, ring in zip(self.plots, self.rings, strict=True):
            plot.addItem(ring, ignoreBounds=True)
        self.outside = [plots.OutsideNote(plot) for plot in (self.position, self.depth)]
        self._drawn: list[tuple[pg.PlotItem, Any]] = []
        self._shown: dict[str, tuple[Series, Float]] = {}
        self.limit = 1.0
        self.count: int | None = None
        """Scan lines of the image; None: not known. Beside them nothing is pointed at."""
        self.repaint_theme()

    def show_series(
        self, axis: str, truth: Series | None, measured: dict[str, tuple[Series, Float]], view: ErrorView
    ) -> None:
        """measured: by method, with its errors in the view's unit; drawn in mm where they are large."""
        for plot, item in self._drawn:
            plot.removeItem(item)
        self._drawn = []
        largest = max([plots.error_limit(error) for _, error in measured.values()], default=1.0)
        unit, factor = readable_unit(view.unit, largest)
        measured = {method: (series, factor * error) for method, (series, error) in measured.items()}
        self._shown = measured
        limit = self.limit = factor * largest
        self.error.setLabel("bottom", "Row" if axis == "rows" else "Column")
        self.position.setLabel("left", f"{'u' if axis == 'rows' else 'v'} / px")
        self.error.setLabel("left", f"Error / {unit}")
        for method, (series, error) in reversed(measured.items()):  # the first method on top
            for plot, values in ((self.position, series.position), (self.depth, series.depth), (self.error, error)):
                here = np.isfinite(values) if plot is not self.error else np.abs(values) <= limit
                self._add(plot, plots.dots(method_colour(method))).setData(series.index[here], values[here])
        if truth is not None:  # thin, over the dots, so that both can be seen
            for plot, values in ((self.position, truth.position), (self.depth, truth.depth)):
                self._add(plot, plots.curve(TRUTH)).setData(truth.index, values)
        for method, (series, error) in reversed(measured.items()):
            off = np.abs(error) > limit
            marks = series.index[off], np.sign(error[off]) * limit
            self._add(self.error, plots.crosses(method_colour(method))).setData(*marks)
        self._fit(truth, [series for series, _ in measured.values()])
        self.error.setYRange(-limit, limit, padding=0.06)
        self.mark(None)

    def _fit(self, truth: Series | None, measured: list[Series]) -> None:
        """To the line: one stray point would make it flat. A double click shows those outside too."""
        for plot in self.plots:
            if self.count is not None:
                plot.vb.setLimits(xMin=-0.5, xMax=self.count - 0.5)
            plot.enableAutoRange()
        names: tuple[Column, Column] = ("position", "depth")
        for note, name in zip(self.outside, names, strict=True):
            ends = line_range(name, truth, measured)
            if ends is not None and ends[1] > ends[0]:
                note.plot.setYRange(*ends, padding=0.0)
            note.show_of(np.concatenate([np.zeros(0), *(getattr(one, name) for one in measured)]), ends)

    def mark(self, scan_line: int | None) -> None:
        """Put the cursor on a scan line, and a ring around its samples."""
        for line in self.cursors:
            line.setVisible(scan_line is not None)
            if scan_line is not None:
                line.setPos(scan_line)
        for k, ring in enumerate(self.rings):
            x: list[float] = []
            y: list[float] = []
            for series, error in self._shown.values():
                here = np.flatnonzero(series.index == scan_line) if scan_line is not None else np.zeros(0, dtype=int)
                values = self._drawn_values(k, series, error)[here]
                x += series.index[here][np.isfinite(values)].tolist()
                y += values[np.isfinite(values)].tolist()
            ring.setData(x, y)

    def repaint_theme(self) -> None:
        c = theme.colours()
        self.setBackground(c.base)
        for plot in self.plots:
            plots.paint(plot)
        for line in self.cursors:
            line.setPen(pg.mkPen(c.text, width=1))
        for ring in self.rings:
            ring.setPen(pg.mkPen(c.text, width=1.5))
        self.zero.setPen(pg.mkPen(c.muted, width=1))
        for note in self.outside:
            note.tell()
        self.paint_range()

    def _add(self, plot: pg.PlotItem, item: Any) -> Any:
        plot.addItem(item)
        self._drawn.append((plot, item))
        return item

    def _drawn_values(self, k: int, series: Series, error: Float) -> Float:
        """What the k-th plot shows of a method, (n,)."""
        return (series.position, series.depth, np.clip(error, -self.limit, self.limit))[k]

    def _near(self, k: int, point: QPointF) -> int | None:
        """The scan line of the dot that is nearest; None: none is near, or each has pixels of its own."""
        width, height = self.plots[k].vb.viewPixelSize()
        if width <= 1.0:
            return None
        found, least = None, REACH_PX
        for series, error in self._shown.values():
            values = self._drawn_values(k, series, error)
            away = np.hypot((series.index - point.x()) / width, (values - point.y()) / height)
            away = np.where(np.isfinite(away), away, np.inf)
            if len(away) and away.min() < least:
                found, least = int(series.index[np.argmin(away)]), float(away.min())
        return found

    def scan_line_at(self, position: QPointF) -> int | None:
        """Of the dot under the mouse, which may not be that of its column: rows lie closer than pixels."""
        for k, plot in enumerate(self.plots):
            point = plots.at(plot, position)
            if point is not None:
                near = self._near(k, point)
                scan_line = round(point.x()) if near is None else near
                return scan_line if self.count is None or 0 <= scan_line < self.count else None
        return None
