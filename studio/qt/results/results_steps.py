"""The error over the steps of a scan: where along the way it measures worse."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Signal

from analysis.report.colour import method_colour
from render.base.arrays import Float
from studio.qt.results import plots
from studio.scan.result_series import ErrorView, readable_unit


class StepsPlot(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """RMSE of each step, and about zero its mean error. A click looks at a step."""

    chosen = Signal(int)

    def __init__(self) -> None:
        super().__init__()
        self.plot, self.zero, self.cursor = plots.only_plot(self, "Step", "Error", 0.0, plots.WholeAxis())
        self.rmse = pg.PlotDataItem(connect="finite", symbolSize=5, symbolPen=None)
        self.bias = pg.PlotDataItem(connect="finite")
        for item in (self.bias, self.rmse):
            self.plot.addItem(item)
        self.count = 0
        self.scene().sigMouseClicked.connect(self._click)
        self.repaint_theme()

    def show_steps(self, method: str, bias: Float, rmse: Float, view: ErrorView, title: str = "") -> None:
        """(steps,) in the view's unit, of the scan's own method; drawn in mm where they are large."""
        self.count = len(rmse)
        plots.set_title(self.plot, title)
        largest = max((float(value) for value in rmse if math.isfinite(value)), default=0.0)  # no mean error is larger
        unit, factor = readable_unit(view.unit, largest)
        self.plot.setLabel("left", f"{view.title} / {unit}")
        steps, colour = np.arange(1, self.count + 1), method_colour(method)
        self.rmse.setPen(pg.mkPen(colour, width=1.6))
        self.rmse.setData(
            steps, factor * rmse, symbol="o" if self.count <= 200 else None, symbolBrush=pg.mkBrush(colour)
        )
        self.bias.setPen(pg.mkPen(colour, width=1.2, style=pg.QtCore.Qt.PenStyle.DashLine))
        self.bias.setData(steps, factor * bias)
        self.plot.enableAutoRange()

    def mark(self, step: int) -> None:
        """A line at the step that is looked at."""
        self.cursor.setVisible(self.count > 0)
        self.cursor.setPos(step + 1)

    def repaint_theme(self) -> None:
        plots.paint_only(self, self.plot, self.zero, self.cursor)

    def _click(self, event: Any) -> None:
        point = plots.at(self.plot, event.scenePos())
        if event.double():
            self.plot.enableAutoRange()
        elif point is not None and self.count:
            self.chosen.emit(min(max(round(point.x()) - 1, 0), self.count - 1))
