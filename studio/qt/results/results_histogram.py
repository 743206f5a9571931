"""How the errors are spread: one outline for each method, centred on zero."""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg

from analysis.report.colour import method_colour
from render.base.arrays import Float
from studio.qt.results import plots
from studio.scan.result_series import ErrorView, histogram, readable_unit


class ErrorHistogram(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """Counts of points over their signed error."""

    def __init__(self) -> None:
        super().__init__()
        self.plot, self.zero, self.cursor = plots.only_plot(self, "Depth error / µm", "Points", 90.0)
        self._outlines: list[Any] = []
        self._factor = 1.0
        """From the unit of the errors to the axis's."""
        self.repaint_theme()

    def show_errors(self, measured: dict[str, Float], view: ErrorView, title: str = "") -> None:
        """measured: errors in the view's unit, by method; what lies beyond the axis is counted at its ends.

        Drawn in mm where they are large.
        """
        plots.set_title(self.plot, title)
        for item in self._outlines:
            self.plot.removeItem(item)
        self._outlines = []
        largest = max([plots.error_limit(error) for error in measured.values()], default=1.0)
        unit, self._factor = readable_unit(view.unit, largest)
        limit = self._factor * largest
        self.plot.setLabel("bottom", f"{view.title} / {unit}")
        for method, error in reversed(measured.items()):  # the first method on top
            edges, counts = histogram(self._factor * error, limit)
            colour = pg.mkColor(method_colour(method))
            fill = pg.mkColor(colour)
            fill.setAlpha(45)
            outline = pg.PlotCurveItem(
                edges, counts, stepMode="center", pen=pg.mkPen(colour, width=1.6), fillLevel=0.0, brush=fill
            )
            self.plot.addItem(outline)
            self._outlines.append(outline)
        self.plot.enableAutoRange()
        self.plot.setXRange(-limit, limit, padding=0.02)

    def mark(self, error: float | None) -> None:
        """A line at the error of the hovered scan line, in the view's unit."""
        self.cursor.setVisible(error is not None)
        if error is not None:
            self.cursor.setPos(self._factor * error)

    def repaint_theme(self) -> None:
        plots.paint_only(self, self.plot, self.zero, self.cursor)
