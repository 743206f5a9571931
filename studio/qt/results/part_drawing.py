"""The part's measures in the profile: fitted curves, dimension, and the regions of the one that is chosen."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QObject, Qt, Signal

from analysis.gauges.gauge import REGIONS, Gauge, Kind
from analysis.gauges.outline import outline
from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading
from analysis.report.gauge_table import label_of
from render.base.arrays import Float
from studio.qt.core import theme
from studio.qt.results import plots
from studio.qt.results.inside_text import InsideText

NAME_AT, NAME_APART = 0.95, -0.08
"""Of the plot's height, from its top: names stand at the bottom, values beside their dimensions."""
FILLED = 33
"""Places along a dimension that its value is not to cover."""
TO_PLOT = np.array([1e3, -1e3])
"""From across and height, m, to the plot's mm along the fan and mm from the laser."""


class PartDrawing(QObject):
    """Over a profile's plot. `moving` and `moved` tell the regions of the chosen measure, m, as edges are dragged."""

    moving = Signal(object)
    moved = Signal(object)

    def __init__(self, plot: pg.PlotItem, parent: QObject) -> None:
        super().__init__(parent)
        self.plot = plot
        self.spans: list[plots.Span] = []
        self.locked = True
        """Regions are drawn but not to be moved, and a drag is the plot's."""
        self.texts: list[InsideText] = []
        """Of the chosen measure, where it is drawn."""
        self._items: list[Any] = []
        self._made_for: tuple[Kind | None, str] = None, ""

    def show_readings(
        self, readings: list[Reading], profile: Profile | None, chosen: Gauge | None, step: str = ""
    ) -> None:
        """Curves and dimension of each; the chosen one thicker, with its value, and the step where one is given."""
        for item in (*self._items, *self.texts):
            self.plot.removeItem(item)
        self._items, self.texts = [], []
        for one in readings:
            if profile is None or one.reason:
                continue
            curves, dimension = outline(one.gauge, profile)
            is_chosen, colour = one.gauge == chosen, theme.verdict_colour(one.verdict)
            for curve in curves:
                self._line(curve, pg.mkPen(colour, width=3.0 if is_chosen else 1.6))
            if len(dimension):
                self._line(dimension, pg.mkPen(colour, width=1.6, style=Qt.PenStyle.DashLine))
            if is_chosen and (curves or len(dimension)):
                at = dimension.mean(axis=0) if len(dimension) else curves[0][-1]
                drawn = np.concatenate([profile.position, *curves, _filled(dimension)])
                self._text(label_of(one, step), at, colour, drawn)

    def show_regions(self, kind: Kind | None, regions: Sequence[tuple[float, float]] = ()) -> None:
        """Of one measure, as many as there are yet; once all are there they move, unless `locked`. None: of none."""
        colour = theme.colours().accent
        if (kind, colour) != self._made_for:
            for span in self.spans:
                self.plot.removeItem(span)
            names = () if kind is None else REGIONS[kind]
            # one below the other, so that the names of narrow regions do not cover each other
            self.spans = [plots.Span(self.plot, colour, name, NAME_AT + NAME_APART * i) for i, name in enumerate(names)]
            for span in self.spans:
                span.edges_moving.connect(partial(self._tell, self.moving))
                span.edges_moved.connect(partial(self._tell, self.moved))
            self._made_for = kind, colour
        for span in self.spans:
            span.setMovable(len(regions) == len(self.spans) and not self.locked)
        for span, (low, high) in zip(self.spans, regions, strict=False):
            span.place(1e3 * low, 1e3 * high)
        for span in self.spans[len(regions) :]:
            span.hide()

    def _tell(self, signal: Any, low: float, high: float) -> None:
        # rounded to what a mouse can mean, so that the project file stays legible
        signal.emit(tuple(tuple(round(1e-3 * end, 8) for end in span.ends) for span in self.spans))

    def _line(self, places: Float, pen: Any) -> None:
        across, distance = (places * TO_PLOT).T
        item = pg.PlotCurveItem(across, distance, pen=pen)
        item.setZValue(25)
        self.plot.addItem(item, ignoreBounds=True)
        self._items.append(item)

    def _text(self, text: str, at: Float, colour: str, drawn: Float) -> None:
        item = InsideText(text, colour, drawn * TO_PLOT)
        item.setPos(*(at * TO_PLOT))
        item.setZValue(40)
        self.plot.addItem(item, ignoreBounds=True)
        item.keep_inside()
        self.texts.append(item)


def _filled(line: Float) -> Float:
    """(k, 2) places along a line between two; none of an empty one, as an angle has no dimension."""
    if not len(line):
        return line
    return line[:1] + np.linspace(0.0, 1.0, FILLED)[:, None] * (line[-1:] - line[:1])
