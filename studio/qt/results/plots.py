"""Plots in the theme's colours, and what they have in common: quiet axes, a mark on the hovered scan line."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, QPointF, Qt, Signal
from PySide6.QtGui import QColor, QFontMetricsF

from analysis.measures import MAD_TO_SIGMA
from analysis.report.units import counted
from render.base.arrays import Float
from studio.qt.core import theme
from studio.scan.result_series import symmetric_limit

pg.setConfigOptions(antialias=False)

PLOTTED = 99.5
"""Percent of the errors within an axis, of those that are not FAR."""
FAR = 30.0
"""Robust sigmas: a few wrong peaks metres away would draw errors of micrometres as one flat line."""


def error_limit(error: Float) -> float:
    """Of an axis of errors (n,) centred on zero, with NaN; what lies beyond is drawn at its ends."""
    size = np.abs(error[np.isfinite(error)])
    near = size[size <= FAR * MAD_TO_SIGMA * np.median(size)] if len(size) else size
    return symmetric_limit(near if np.any(near > 0.0) else size, PLOTTED)


class RangeBox(pg.ViewBox):  # type: ignore[misc]
    """A drag chooses a range of x; with Shift or the middle button it moves the view."""

    ranged = Signal(float, float, bool)
    """From, to, and whether the drag is over."""

    def mouseDragEvent(self, event: Any, axis: int | None = None) -> None:
        plain = (
            event.button() == Qt.MouseButton.LeftButton and not event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        )
        if axis is not None or not plain:
            super().mouseDragEvent(event, axis)
            return
        event.accept()
        ends = [self.mapToView(place).x() for place in (event.buttonDownPos(), event.pos())]
        self.ranged.emit(min(ends), max(ends), event.isFinish())


class Span(pg.LinearRegionItem):  # type: ignore[misc]
    """A range of x whose edges can be moved: `edges_moved` tells where to, `edges_moving` meanwhile.

    Neither tells what `place` sets.
    """

    edges_moving = Signal(float, float)
    edges_moved = Signal(float, float)

    def __init__(self, plot: pg.PlotItem, colour: str, name: str = "", height: float = 0.0) -> None:
        """name: written beside its left edge, at a height from 0 to 1 along the axis."""
        super().__init__((0.0, 1.0))
        if name:
            pg.InfLineLabel(self.lines[0], name, position=height, anchors=[(0.0, 0.5), (0.0, 0.5)], color=colour)
        self.sigRegionChanged.connect(lambda: self.edges_moving.emit(*self.ends))
        self.sigRegionChangeFinished.connect(lambda: self.edges_moved.emit(*self.ends))
        self.paint_in(colour)
        self.hide()
        plot.addItem(self, ignoreBounds=True)

    @property
    def ends(self) -> tuple[float, float]:
        low, high = sorted(self.getRegion())
        return low, high

    def place(self, low: float, high: float) -> None:
        self.blockSignals(True)
        self.setRegion((low, high))
        self.blockSignals(False)
        self.show()

    def paint_in(self, colour: str) -> None:
        fill, hovered = QColor(colour), QColor(colour)
        fill.setAlpha(38)
        hovered.setAlpha(64)
        self.setBrush(fill)
        self.setHoverBrush(hovered)
        for line in self.lines:
            line.setPen(pg.mkPen(colour, width=1.2))
            line.setHoverPen(pg.mkPen(colour, width=3))


class UprightAxis(pg.AxisItem):  # type: ignore[misc]
    """A left axis whose title is shown where it is high enough for it: of low plots one above the other, titles would
    lie over each other."""

    def __init__(self) -> None:
        super().__init__("left")

    def tickSpacing(self, minVal: float, maxVal: float, size: float) -> list[tuple[float, float]]:
        """Labels of the coarsest ticks are drawn however low the plot is: they get farther apart there."""
        levels = [(float(spacing), float(offset)) for spacing, offset in super().tickSpacing(minVal, maxVal, size)]
        apart = QFontMetricsF(self.font()).height() * (maxVal - minVal) / max(size, 1.0)
        low, high = minVal + 0.5 * apart, maxVal - 0.5 * apart
        # of two labels that are seen one is left at twice their distance
        while levels[0][0] < apart and math.floor(high / levels[0][0]) > math.ceil(low / levels[0][0]):
            levels = [(2.0 * levels[0][0], 0.0), *levels]
        return levels

    def tickStrings(self, values: Any, scale: float, spacing: float) -> list[str]:
        """From 10,000 on in thousands, so that the minus sign has room."""
        if len(values) and max(abs(float(value) * scale) for value in values) >= 1e4:
            return [f"{float(value) * scale / 1e3:g}k" if value else "0" for value in values]
        return list(super().tickStrings(values, scale, spacing))

    def resizeEvent(self, event: Any = None) -> None:
        super().resizeEvent(event)
        # the title itself knows nothing of its being turned
        self.label.setVisible(self.label.boundingRect().width() <= self.size().height())


class WholeAxis(pg.AxisItem):  # type: ignore[misc]
    """A lower axis of what is counted: there is nothing between two whole numbers."""

    def __init__(self) -> None:
        super().__init__("bottom")

    def tickSpacing(self, minVal: float, maxVal: float, size: float) -> list[tuple[float, float]]:
        found = super().tickSpacing(minVal, maxVal, size)
        return [(float(spacing), 0.0) for spacing, _ in found if spacing >= 1.0] or [(1.0, 0.0)]


class OutsideNote(pg.LabelItem):  # type: ignore[misc]
    """In a plot's corner: how many of its stray points lie above or below what it shows."""

    def __init__(self, plot: pg.PlotItem) -> None:
        super().__init__("", size="8pt")
        self.plot = plot
        self._stray: Float = np.zeros(0)
        self.setParentItem(plot.vb)
        self.anchor(itemPos=(1, 0), parentPos=(1, 0), offset=(-4, 0))
        plot.vb.sigYRangeChanged.connect(self.tell)

    def show_of(self, values: Float, ends: tuple[float, float] | None) -> None:
        """Of values along y, which are stray beyond ends; None: none is."""
        low, high = ends or (-math.inf, math.inf)
        self._stray = values[(values < low) | (values > high)]
        self.tell()

    def tell(self) -> None:
        low, high = self.plot.vb.viewRange()[1]
        count = int(np.count_nonzero((self._stray < low) | (self._stray > high)))
        self.setText(counted(count, "point") + " outside" if count else "", color=theme.colours().muted)


class PointedPlots(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """Plots whose samples belong to scan lines. `hovered` tells the one under the mouse, None when it leaves."""

    hovered = Signal(object)
    chosen = Signal(int)
    ranged = Signal(float, float)
    """A range of x was dragged, or its edges were."""

    def __init__(self, *shown: pg.PlotItem) -> None:
        """shown: from top to bottom."""
        super().__init__()
        self.plots = shown
        for row, plot in enumerate(shown):
            self.addItem(plot, row=row, col=0)
            plot.getAxis("left").setWidth(62)
        self.ci.layout.setContentsMargins(2, 4, 8, 2)
        self.spans = [Span(plot, theme.colours().muted) for plot in shown]
        for plot, span in zip(shown, self.spans, strict=True):
            plot.vb.ranged.connect(self._range)
            span.edges_moving.connect(self.show_range)
            span.edges_moved.connect(self.ranged)
        self.scene().sigMouseMoved.connect(self._move)
        self.scene().sigMouseClicked.connect(self._click)

    def scan_line_at(self, position: QPointF) -> int | None:
        """Of the sample at a place of the widget, None where none is near."""
        raise NotImplementedError

    def show_range(self, low: float, high: float) -> None:
        for span in self.spans:
            span.place(low, high)

    def hide_range(self) -> None:
        for span in self.spans:
            span.hide()

    def paint_range(self) -> None:
        for span in self.spans:
            span.paint_in(theme.colours().muted)

    def _range(self, low: float, high: float, over: bool) -> None:
        self.show_range(low, high)
        if over:
            self.ranged.emit(low, high)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self.hovered.emit(None)

    def _move(self, position: QPointF) -> None:
        self.hovered.emit(self.scan_line_at(position))

    def _click(self, event: Any) -> None:
        scan_line = self.scan_line_at(event.scenePos())
        if event.double():
            for plot in self.plots:
                plot.enableAutoRange()
        elif scan_line is not None:
            self.chosen.emit(scan_line)


def new_plot(
    bottom: str = "",
    left: str = "",
    left_unit: str = "",
    box: pg.ViewBox | None = None,
    lower: pg.AxisItem | None = None,
) -> pg.PlotItem:
    """An empty plot; the unit is part of the label, so that no prefix is put before it. lower: the axis of x."""
    plot = pg.PlotItem(viewBox=box, axisItems={"left": UprightAxis(), "bottom": lower or pg.AxisItem("bottom")})
    plot.setLabel("left", f"{left} / {left_unit}" if left_unit else left)
    if bottom:
        plot.setLabel("bottom", bottom)
    plot.hideButtons()
    plot.setMenuEnabled(False)
    plot.showGrid(x=True, y=True, alpha=0.15)
    for side in ("left", "bottom"):
        plot.getAxis(side).enableAutoSIPrefix(False)
    return plot


def only_plot(
    widget: pg.GraphicsLayoutWidget, bottom: str, left: str, angle: float, lower: pg.AxisItem | None = None
) -> tuple[Any, Any, Any]:
    """The one plot of a widget, a line through its zero at an angle, degrees, and its cursor."""
    plot = new_plot(bottom, left, lower=lower)
    widget.addItem(plot)
    plot.getAxis("left").setWidth(62)
    widget.ci.layout.setContentsMargins(2, 4, 8, 2)
    zero = pg.InfiniteLine(angle=angle, pos=0.0)
    plot.addItem(zero, ignoreBounds=True)
    return plot, zero, cursor(plot)


def paint(plot: pg.PlotItem) -> None:
    """Give a plot the theme's colours."""
    c = theme.colours()
    for side in ("left", "bottom"):
        axis = plot.getAxis(side)
        axis.setPen(pg.mkPen(c.line))
        axis.setTextPen(pg.mkPen(c.muted))
        axis.label.setDefaultTextColor(pg.mkColor(c.muted))


def paint_only(widget: pg.GraphicsLayoutWidget, plot: Any, zero: Any, mark: Any) -> None:
    """Give what `only_plot` made the theme's colours."""
    c = theme.colours()
    widget.setBackground(c.base)
    paint(plot)
    zero.setPen(pg.mkPen(c.muted, width=1))
    mark.setPen(pg.mkPen(c.text, width=1))


def set_title(plot: pg.PlotItem, text: str) -> None:
    """What a plot is of, where its place does not say; empty: no title, and no room for one."""
    plot.setTitle(text or None, size="9pt", color=theme.colours().muted)


def cursor(plot: pg.PlotItem, angle: float = 90.0) -> pg.InfiniteLine:
    """A thin line across a plot, hidden until it is placed."""
    line = pg.InfiniteLine(angle=angle, movable=False)
    line.setZValue(20)
    line.hide()
    plot.addItem(line, ignoreBounds=True)
    return line


def dots(colour: str, size: float = 4.0) -> pg.ScatterPlotItem:
    """Measured samples of one method."""
    return pg.ScatterPlotItem(pen=None, brush=pg.mkBrush(colour), size=size, pxMode=True)


def crosses(colour: str) -> pg.ScatterPlotItem:
    """Samples of one method beyond the ends of the axis, at whose end they are drawn."""
    item = pg.ScatterPlotItem(pen=pg.mkPen(colour, width=1), brush=pg.mkBrush(colour), symbol="x", size=9, pxMode=True)
    item.setZValue(10)
    return item


def ring() -> pg.ScatterPlotItem:
    """The mark around the hovered sample."""
    item = pg.ScatterPlotItem(brush=None, size=11, pxMode=True)
    item.setZValue(30)
    return item


def curve(colour: str, width: float = 1.2) -> pg.PlotCurveItem:
    """A line with gaps at NaN."""
    return pg.PlotCurveItem(pen=pg.mkPen(colour, width=width), connect="finite")


def at(plot: pg.PlotItem, scene_position: QPointF) -> QPointF | None:
    """Where the mouse is in the plot's own coordinates, None outside."""
    if not plot.sceneBoundingRect().contains(scene_position):
        return None
    point: Any = plot.vb.mapSceneToView(scene_position)
    return QPointF(point.x(), point.y())
