"""Icons drawn as thin lines in the text's colour, so that they fit every theme and every pixel density."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QByteArray, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QIcon, QIconEngine, QPainter, QPalette, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QApplication, QToolButton

SHAPES = {
    "new": "<path d='M6 3h8l4 4v14H6zM14 3v4h4M12 11v6M9 14h6'/>",
    "open": "<path d='M3 19V5h6l2 3h9v3M3 19l3-8h15l-3 8z'/>",
    "save": "<path d='M4 4h13l3 3v13H4zM8 4v5h7V4M7 20v-7h10v7'/>",
    "undo": "<path d='M9 6L4 11l5 5M4 11h10a5 5 0 0 1 0 10h-3'/>",
    "redo": "<path d='M15 6l5 5-5 5M20 11H10a5 5 0 0 0 0 10h3'/>",
    "render": "<path d='M7 4l13 8-13 8z' fill='currentColor'/>",
    "play": "<path d='M7 4l13 8-13 8z'/>",
    "pause": "<path d='M8 5v14M16 5v14' stroke-width='3'/>",
    "stop": "<path d='M6 6h12v12H6z'/>",
    "cancel": "<path d='M6 6l12 12M18 6L6 18'/>",
    "first": "<path d='M6 5v14M19 5L9 12l10 7z'/>",
    "previous": "<path d='M17 5L7 12l10 7z'/>",
    "next": "<path d='M7 5l10 7-10 7z'/>",
    "last": "<path d='M18 5v14M5 5l10 7-10 7z'/>",
    "export": "<path d='M12 15V3M8 7l4-4 4 4M5 13v7h14v-7'/>",
    "picture": "<path d='M4 5h16v14H4zM4 16l5-5 4 4 3-3 4 4'/><circle cx='9' cy='9' r='1.2'/>",
    "help": "<path d='M9 9a3 3 0 1 1 4.5 2.6c-1 .6-1.5 1.1-1.5 2.4M12 17.5v.5'/><circle cx='12' cy='12' r='9.5'/>",
    "mesh": "<path d='M12 3l8 5v8l-8 5-8-5V8zM4 8l8 5 8-5M12 13v8'/>",
}
DOCUMENT = (
    "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 24 24' fill='none' stroke='{colour}' "
    "stroke-width='1.6' stroke-linecap='round' stroke-linejoin='round'>{shape}</svg>"
)


class _Engine(QIconEngine):
    """Paints with the palette of the moment, so that a change of theme needs no new icons."""

    def __init__(self, shape: str, accent: str) -> None:
        super().__init__()
        self.shape, self.accent = shape, accent

    def paint(self, painter: QPainter, rect: QRect, mode: QIcon.Mode, state: QIcon.State) -> None:
        role = QPalette.ColorRole.HighlightedText if mode == QIcon.Mode.Selected else QPalette.ColorRole.WindowText
        group = QPalette.ColorGroup.Disabled if mode == QIcon.Mode.Disabled else QPalette.ColorGroup.Active
        colour = QApplication.palette().color(group, role).name()
        shape = self.shape.replace("currentColor", colour).replace("{accent}", self.accent or colour)
        text = DOCUMENT.format(colour=colour, shape=shape)
        QSvgRenderer(QByteArray(text.encode())).render(painter, QRectF(rect))

    def pixmap(self, size: QSize, mode: QIcon.Mode, state: QIcon.State) -> QPixmap:
        made = QPixmap(size)
        if size.isEmpty():  # of a button that a layout has not given its place yet
            return made
        made.fill(Qt.GlobalColor.transparent)
        painter = QPainter(made)
        self.paint(painter, QRect(0, 0, size.width(), size.height()), mode, state)
        painter.end()
        return made

    def clone(self) -> QIconEngine:
        return _Engine(self.shape, self.accent)


def drawn(shape: str, accent: str = "") -> QIcon:
    """An icon of SVG elements on 24 x 24; `currentColor` is the text's colour, `{accent}` the one given (#rrggbb)."""
    return QIcon(_Engine(shape, accent))


def icon(name: str) -> QIcon:
    """One of `SHAPES`."""
    return drawn(SHAPES[name])


def icon_button(name: str, tip: str, handler: Callable[[], None]) -> QToolButton:
    """A button that shows an icon and calls the handler."""
    button = QToolButton()
    button.setIcon(icon(name))
    button.setToolTip(tip)
    button.clicked.connect(handler)
    return button


def dot(colour: str) -> QIcon:
    """A filled circle of a colour that means something."""
    return drawn(f"<circle cx='12' cy='12' r='9' fill='{colour}' stroke='none'/>")
