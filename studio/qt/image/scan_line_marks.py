"""Scan lines marked in the picture: the hovered one, and the range that the results tell of."""

from __future__ import annotations

import pyqtgraph as pg
from PySide6.QtCore import QObject
from PySide6.QtGui import QColor

from studio.qt.core import theme
from studio.qt.core.session import Session
from studio.qt.image.image_item import PictureView


class ScanLineMarks(QObject):
    """Follows the session; a drag with Shift chooses another range, and begins and ends with whole scan lines."""

    def __init__(self, session: Session, view: PictureView) -> None:
        super().__init__(view)
        self.session, self.view = session, view
        self.hover = pg.InfiniteLine()
        self.hover.setZValue(9)
        self.bands = {
            axis: pg.LinearRegionItem(orientation=side, movable=False)
            for axis, side in (("rows", "horizontal"), ("columns", "vertical"))
        }
        for item in (self.hover, *self.bands.values()):
            item.hide()
            view.box.addItem(item, ignoreBounds=True)
        view.box.boxed.connect(self._drag)
        session.hover_changed.connect(self._show_hover)
        session.range_changed.connect(self._show_range)
        theme.notice.changed.connect(self._colour)
        self._colour()

    @property
    def axis(self) -> str:
        """Whether scan lines are rows or columns of the picture."""
        return (self.session.shown or self.session).project.extraction.axis

    def _colour(self) -> None:
        accent = QColor(theme.colours().accent)
        self.hover.setPen(pg.mkPen(accent, width=1))
        ground = QColor(accent)
        ground.setAlpha(48)
        for band in self.bands.values():
            band.setBrush(ground)
            for line in band.lines:
                line.setPen(pg.mkPen(accent, width=1))

    def _show_hover(self) -> None:
        hovered = self.session.hovered
        self.hover.setVisible(hovered is not None)
        if hovered is not None:
            self.hover.setAngle(0 if self.axis == "rows" else 90)
            self.hover.setValue(float(hovered))

    def _show_range(self) -> None:
        self._place(self.session.range)

    def _place(self, ends: tuple[float, float] | None) -> None:
        for axis, band in self.bands.items():
            band.setVisible(ends is not None and axis == self.axis)
            if ends is not None:
                band.setRegion(ends)

    def _drag(self, columns: tuple[float, float], rows: tuple[float, float], over: bool) -> None:
        if self.session.shown is None:
            return
        ends = rows if self.axis == "rows" else columns
        whole = round(min(ends)) - 0.5, round(max(ends)) + 0.5
        self._place(whole)
        if over:
            self.session.range_dragged.emit(*whole)
            self._show_range()  # what was dragged may have become a measure's region
