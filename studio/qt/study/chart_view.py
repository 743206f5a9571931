"""A study's chart in the window: drawn in the background; the nearest spot is ringed, told, and opened by a click."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from render.base.threads import Cancel
from studio.qt.core import theme
from studio.qt.core.jobs import JobRunner
from studio.runtime.jobs import Progress

if TYPE_CHECKING:
    from studio.qt.study.chart_drawing import Drawing
    from studio.study.answers import Answer

NEAR_PX = 16.0
REST_MS = 60
"""Of the size, before the chart is drawn anew."""


class ChartView(QWidget):
    hovered = Signal(object)
    """The index of the spot under the mouse, or None."""
    chosen = Signal(int)
    drawn = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setMouseTracking(True)
        self.setMinimumSize(240, 160)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.runner = JobRunner(self)
        self.drawing: Drawing | None = None
        self.spot: int | None = None
        """The one that is ringed."""
        self._image: QImage | None = None
        self._shown: tuple[Answer, dict[str, str]] | None = None
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self._draw)
        theme.notice.changed.connect(self._rest.start)

    def show_answer(self, answer: Answer | None, labels: dict[str, str]) -> None:
        """None: there is nothing to draw yet."""
        self._shown = (answer, labels) if answer is not None and answer.spots else None
        if self._shown is None:
            self.runner.cancel("draw")
            self.drawing = self._image = None
            self.update()
        else:
            self._draw()

    def mark(self, spot: int | None) -> None:
        """Put a ring around a spot."""
        if spot != self.spot:
            self.spot = spot
            self.update()

    def close(self) -> bool:
        self._rest.stop()
        self.runner.close()
        return super().close()

    def sizeHint(self) -> QSize:
        return QSize(640, 380)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._rest.start()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        spot = self.spot_at(event.position())
        self.setCursor(Qt.CursorShape.PointingHandCursor if spot is not None else Qt.CursorShape.ArrowCursor)
        self.hovered.emit(spot)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        spot = self.spot_at(event.position())
        if spot is not None and event.button() == Qt.MouseButton.LeftButton:
            self.chosen.emit(spot)

    def leaveEvent(self, event: QEvent) -> None:
        super().leaveEvent(event)
        self.hovered.emit(None)

    def spot_at(self, place: QPointF) -> int | None:
        """The spot that is near a place of the widget."""
        if self.drawing is None:
            return None
        apart = np.hypot(*(self.drawing.spots - [place.x(), place.y()]).T)
        if not np.isfinite(apart).any():
            return None
        nearest = int(np.nanargmin(apart))
        return nearest if apart[nearest] <= NEAR_PX else None

    def paintEvent(self, event: QPaintEvent) -> None:
        colours = theme.colours()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(colours.base))
        if self._image is not None:
            painter.drawImage(0, 0, self._image)
        if self.drawing is not None and self.spot is not None and self.spot < len(self.drawing.spots):
            x, y = self.drawing.spots[self.spot]
            if np.isfinite([x, y]).all():
                painter.setPen(QPen(QColor(colours.accent), 2.0))
                painter.drawEllipse(QPointF(x, y), 8.0, 8.0)
        painter.end()

    def _draw(self) -> None:
        if self._shown is None:
            return
        answer, labels = self._shown
        size, ratio, colours = (self.width(), self.height()), self.devicePixelRatioF(), theme.colours()

        def work(progress: Progress, cancelled: Cancel) -> Drawing:
            from studio.qt.study.chart_drawing import draw

            return draw(answer, labels, size, ratio, colours)

        self.runner.run("draw", "draw the chart", work, self._take)

    def _take(self, drawing: Drawing) -> None:
        if self._shown is None:
            return
        height, width, _ = drawing.pixels.shape
        image = QImage(drawing.pixels.tobytes(), width, height, 4 * width, QImage.Format.Format_RGBA8888).copy()
        image.setDevicePixelRatio(drawing.ratio)
        self.drawing, self._image = drawing, image
        self.update()
        self.drawn.emit()
