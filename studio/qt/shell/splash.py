"""The splash: the first thing on the screen, which says what is being loaded."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QLinearGradient, QPainter, QPaintEvent, QPen, QPixmap, QPolygonF
from PySide6.QtWidgets import QApplication, QWidget

from studio.qt.core import theme

WIDTH, HEIGHT = 460, 220


class Splash(QWidget):
    """Shown until the window is. Not a QSplashScreen, which may hold the start up for a second until it is exposed."""

    def __init__(self) -> None:
        super().__init__(None, Qt.WindowType.SplashScreen | Qt.WindowType.FramelessWindowHint)
        screen = QApplication.primaryScreen()
        self.picture = picture(screen.devicePixelRatio())
        self.text = ""
        self.setFixedSize(WIDTH, HEIGHT)
        self.move(screen.availableGeometry().center() - self.rect().center())

    def tell(self, what: str) -> None:
        """What is loading now."""
        self.text = f"Loading: {what.lower()}"
        self.repaint()
        QApplication.processEvents()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self.picture)
        painter.setPen(QColor(theme.colours().muted))
        painter.drawText(self.rect().adjusted(28, 0, 0, -14), Qt.AlignmentFlag.AlignBottom, self.text)


def picture(ratio: float) -> QPixmap:
    """The name, over a sheet of light that falls on a step."""
    c = theme.colours()
    made = QPixmap(round(WIDTH * ratio), round(HEIGHT * ratio))
    made.setDevicePixelRatio(ratio)
    made.fill(QColor(c.window))
    painter = QPainter(made)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    sheet = QLinearGradient(340, 10, 340, 180)
    for at, alpha in ((0.0, 190), (1.0, 25)):
        colour = QColor(c.accent)
        colour.setAlpha(alpha)
        sheet.setColorAt(at, colour)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(sheet)
    painter.drawPolygon(
        QPolygonF([QPointF(345, 14), QPointF(265, 172), QPointF(330, 172), QPointF(350, 132), QPointF(425, 132)])
    )
    painter.setPen(QPen(QColor(c.accent), 2.5))
    painter.drawPolyline(QPolygonF([QPointF(265, 172), QPointF(330, 172), QPointF(350, 132), QPointF(425, 132)]))
    painter.setPen(QColor(c.text))
    font = painter.font()
    font.setPointSizeF(21)
    font.setBold(True)
    painter.setFont(font)
    painter.drawText(QPointF(28, 84), "Blazer Studio")
    font.setPointSizeF(9.5)
    font.setBold(False)
    painter.setFont(font)
    painter.setPen(QColor(c.muted))
    painter.drawText(
        QRectF(28, 98, 240, 60),
        Qt.TextFlag.TextWordWrap,
        "Laser line scanners, simulated:\nplace, render, see the error",
    )
    painter.end()
    return made
