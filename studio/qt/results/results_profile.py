"""The profile: the points in the laser's plane, as a scanner would deliver them, or in a section; and the true one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QPointF

from analysis.report.colour import TRUTH, method_colour
from studio.project.project import ProfileSection
from studio.qt.core import theme
from studio.qt.results import plots
from studio.scan.first_range import profile_range
from studio.scan.result_series import Series

NEAR = 30.0
"""px; the mouse hovers a sample that is no farther than this."""


class ProfilePlot(plots.PointedPlots):
    """Distance from the laser over the place along its fan, both mm. Nearer is up."""

    def __init__(self) -> None:
        self.section: ProfileSection = "laser_plane"
        self.plot = plots.new_plot("Along the fan / mm", _height(self.section), "mm", plots.RangeBox())
        super().__init__(self.plot)
        self.plot.invertY(True)
        self.truth = plots.curve(TRUTH)
        self.truth.setZValue(10)
        self.plot.addItem(self.truth)
        self.ring = plots.ring()
        self.plot.addItem(self.ring, ignoreBounds=True)
        self._dots: list[Any] = []
        self._shown: dict[str, Series] = {}
        self.held = False
        """The axes stay as they are, as ranges are being dragged in them; those of another section are others."""
        self.repaint_theme()

    def show_series(self, truth: Series | None, measured: dict[str, Series], section: ProfileSection) -> None:
        """measured: by method."""
        another = section != self.section
        if another:
            self.section = section
            self.plot.setLabel("left", f"{_height(section)} / mm")
        for item in self._dots:
            self.plot.removeItem(item)
        self._dots, self._shown = [], measured
        if truth is None:
            self.truth.setData([], [])
        else:
            self.truth.setData(truth.across, truth.distance)
        for method, series in reversed(measured.items()):  # the first method on top
            item = plots.dots(method_colour(method))
            here = np.isfinite(series.distance)
            item.setData(series.across[here], series.distance[here])
            self.plot.addItem(item)
            self._dots.append(item)
        if another or not self.held:
            self._fit(truth)
        self.mark(None)

    def _fit(self, truth: Series | None) -> None:
        """To the part: false points may be far from it; a double click shows them too."""
        ends = profile_range(truth, list(self._shown.values()))
        if ends is None or not all(high > low for low, high in ends):
            self.plot.enableAutoRange()
        else:
            self.plot.setRange(xRange=ends[0], yRange=ends[1], padding=0.02)

    def mark(self, scan_line: int | None) -> None:
        """A ring around the samples of a scan line."""
        x: list[float] = []
        y: list[float] = []
        for series in self._shown.values() if scan_line is not None else ():
            here = np.flatnonzero((series.index == scan_line) & np.isfinite(series.distance))
            x += series.across[here].tolist()
            y += series.distance[here].tolist()
        self.ring.setData(x, y)

    def repaint_theme(self) -> None:
        c = theme.colours()
        self.setBackground(c.base)
        plots.paint(self.plot)
        self.ring.setPen(pg.mkPen(c.text, width=1.5))
        self.paint_range()

    def scan_line_at(self, position: QPointF) -> int | None:
        """Of the nearest sample."""
        point = plots.at(self.plot, position)
        if point is None:
            return None
        width, height = self.plot.vb.viewPixelSize()
        best, found = NEAR**2, None
        for series in self._shown.values():
            squared = ((series.across - point.x()) / width) ** 2 + ((series.distance - point.y()) / height) ** 2
            if len(squared) and np.isfinite(squared).any():
                i = int(np.nanargmin(squared))
                if squared[i] < best:
                    best, found = float(squared[i]), int(series.index[i])
        return found


def _height(section: ProfileSection) -> str:
    return "Distance from the laser" if section == "laser_plane" else "Distance in the section"
