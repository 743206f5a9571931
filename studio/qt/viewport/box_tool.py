"""B: a rectangle drawn over the 3D view, about points that are to be told of."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QRect, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QRubberBand

from studio.qt.viewport.view3d import View3D
from studio.qt.viewport.view_mode import ViewMode

HINT = "draw a rectangle about points; Esc: back"
LEAST_PX = 3


class BoxTool(ViewMode):
    """One rectangle at a time; holds the left button while it is on, as `studio.qt.viewport.view3d.Tool`."""

    drawn = Signal(QRect)
    """Of the view, in the pixels that mouse events count."""

    def __init__(self, view: View3D) -> None:
        super().__init__(view)
        self._band = QRubberBand(QRubberBand.Shape.Rectangle, view)
        self._start = QPoint()

    def begin(self) -> None:
        """The next drag is the rectangle; once more: it is not."""
        if self.active:
            self.end()
            return
        self.enter(HINT, tool=self)

    def end(self) -> None:
        """The left button does again what it did."""
        if self.active:
            self._band.hide()
            self.leave()

    def press(self, x: float, y: float) -> bool:
        self._start = QPoint(round(x), round(y))
        self._band.setGeometry(QRect(self._start, QSize()))
        self._band.show()
        return True

    def drag(self, x: float, y: float, snap: bool) -> None:
        self._band.setGeometry(QRect(self._start, QPoint(round(x), round(y))).normalized())

    def release(self) -> None:
        rectangle = self._band.geometry()
        self.end()
        if min(rectangle.width(), rectangle.height()) >= LEAST_PX:
            self.drawn.emit(rectangle)

    def cancel(self) -> None:
        self.view.let_go()
        super().cancel()

    def hover(self, x: float, y: float) -> bool:
        return False

    def draw(self) -> None:
        """Qt draws it."""

    def type(self, event: QKeyEvent) -> bool:
        """Escape ends it; other keys mean what they mean."""
        if Qt.Key(event.key()) == Qt.Key.Key_Escape:
            if event.type() == QEvent.Type.KeyPress:
                self.cancel()
            return True
        if Qt.Key(event.key()) in (Qt.Key.Key_G, Qt.Key.Key_R, Qt.Key.Key_T, Qt.Key.Key_V):
            self.end()
        return False
