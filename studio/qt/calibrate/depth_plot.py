"""The depth error that the calibration makes, over a laser's plane: across by distance, in colours with their scale."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF

from studio.calibration.drawings import DepthMap
from studio.qt.core import theme

COLOURS = "viridis"
AXIS_PX = 64
"""Of the colours' scale, with its numbers and its name."""


class DepthPlot(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """Follows the theme."""

    def __init__(self) -> None:
        super().__init__()
        self.plot = self.addPlot()
        self.plot.setLabel("bottom", "across / mm")
        self.plot.setLabel("left", "distance / mm")
        self.plot.hideButtons()
        self.plot.setMenuEnabled(False)
        self.picture = pg.ImageItem(axisOrder="row-major")
        self.plot.addItem(self.picture)
        self.scale = pg.ColorBarItem(colorMap=pg.colormap.get(COLOURS), interactive=False, width=14)
        self.scale.setImageItem(self.picture, insert_in=self.plot)
        self.scale.getAxis("right").setLabel("sigma of depth / µm")
        self.scale.getAxis("right").setWidth(AXIS_PX)
        for axis in self._axes():
            axis.enableAutoSIPrefix(False)
        self.ci.layout.setContentsMargins(4, 8, 8, 4)
        theme.notice.changed.connect(self.paint_anew)
        self.paint_anew()

    def show_map(self, shown: DepthMap) -> None:
        micrometres = 1e6 * shown.sigma
        if not np.isfinite(micrometres).any():
            self.picture.clear()
            return
        low, high = float(np.nanmin(micrometres)), float(np.nanmax(micrometres))
        self.picture.setImage(micrometres, autoLevels=False)
        (x0, x1), (z0, z1) = shown.across, shown.depth
        self.picture.setRect(QRectF(1e3 * x0, 1e3 * z0, 1e3 * (x1 - x0), 1e3 * (z1 - z0)))
        self.scale.setLevels((low, max(high, low * (1.0 + 1e-6))))
        self.plot.autoRange(padding=0.02)

    def paint_anew(self) -> None:
        """In the theme's colours."""
        c = theme.colours()
        self.setBackground(c.base)
        for axis in self._axes():
            axis.setPen(pg.mkPen(c.line))
            axis.setTextPen(pg.mkPen(c.muted))
            axis.label.setDefaultTextColor(pg.mkColor(c.muted))

    def _axes(self) -> tuple[pg.AxisItem, ...]:
        return (self.plot.getAxis("left"), self.plot.getAxis("bottom"), self.scale.getAxis("right"))
