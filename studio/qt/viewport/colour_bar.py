"""The bar that says which colour is which value; its ends are handles, its menu has percentiles, unit and meaning."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRect, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QContextMenuEvent, QLinearGradient, QMouseEvent, QPainter, QPaintEvent, QPolygonF
from PySide6.QtWidgets import QMenu, QWidget

from render.base.arrays import Float
from studio.qt.core import theme
from studio.scan.colour_scale import PER_METRE, SHARES, ColourScale, tick
from studio.scan.result_series import readable_unit

TIP = (
    "Drag an end to another value; a double click brings back what was there. Right click: percentiles, "
    "mm or \u00b5m, colours by error or by height"
)
REACH_PX = 9
"""From an end of the bar at which the mouse has hold of it."""
LEFT, WIDTH = 14, 14
ABOVE, BELOW = (34, 28), (36, 14)
"""px about the bar: for title and note; in a low view for the title alone."""
ROOM_FOR_SIDES = 70
"""px of the bar's height, for words beside its ticks."""
NARROW, LOW = 480, 150
"""px of width and height of a view of which a bar of the usual size would hide too much."""


class ColourBar(QWidget):
    """Lies in the lower right corner of the view."""

    scaled = Signal(object)
    """Another `ColourScale` is asked for."""
    unit_chosen = Signal()
    height_chosen = Signal(bool)

    def __init__(self, view: QWidget) -> None:
        super().__init__(view)
        self.title, self.unit, self.note = "", "", ""
        self.sides = "", ""
        """What lies towards the lower and the upper end, of signed values."""
        self.scale = ColourScale()
        self.limits = (-1.0, 1.0)
        self.by_share = True
        """No hand and no first limits decide."""
        self.units = {"error": "\u00b5m", "height": "mm", "deviation": "\u00b5m", "map": "mm"}
        """In which lengths of each meaning are told, unless they are large."""
        self._told = dict(self.units)
        """In which they were told last."""
        self._chosen: set[str] = set()
        """Meanings whose unit a person chose."""
        self.meaning = "error"
        self._held: bool | None = None
        """Which end is dragged: the upper one; None: none."""
        self._from = (-1.0, 1.0)
        self.setToolTip(TIP)
        self.setMouseTracking(True)
        view.installEventFilter(self)
        self._place()

    def unit_of(self, meaning: str, largest: float = 0.0, by_hand: bool = False) -> str:
        """In which lengths of it are told. largest: of its limits, µm; by_hand: these stay in the unit they had."""
        self.meaning = meaning
        if not by_hand:
            own = self.units[meaning]
            self._told[meaning] = own if meaning in self._chosen else readable_unit(own, largest)[0]
        return self._told[meaning]

    def show_scale(
        self,
        title: str,
        unit: str,
        scale: ColourScale,
        values: Float,
        image_scale: float = 1.0,
        first: tuple[float, float] | None = None,
        sides: tuple[str, str] = ("", ""),
    ) -> tuple[float, float]:
        """Give the limits of (n,) values, and show them; first: as of `ColourScale.limits`, sides: as here."""
        if sides != self.sides:
            self.setToolTip(f"+ is {sides[1]}, \u2212 is {sides[0]}. {TIP}" if sides[1] else TIP)
        self.title, self.unit, self.scale, self.sides = title, unit, scale, sides
        self.limits = scale.limits(values, first)
        self.by_share = scale.by_hand is None and (first is None or scale.by_share)
        self.note = f"at {image_scale:.3g} x size" if image_scale != 1.0 else ""
        self.update()
        return self.limits

    def menu(self) -> QMenu:
        """What a right click offers."""
        made = QMenu(self)
        for share in SHARES:
            action = made.addAction(f"{share:g} % of the points")
            action.setCheckable(True)
            action.setChecked(self.by_share and self.scale.share == share)
            action.triggered.connect(lambda _=False, share=share: self.scaled.emit(self.scale.automatic(share)))
        if self.unit in PER_METRE:
            made.addSeparator()
            for unit in PER_METRE:
                action = made.addAction(unit)
                action.setCheckable(True)
                action.setChecked(unit == self.unit)
                action.triggered.connect(lambda _=False, unit=unit: self._choose_unit(unit))
        if self.meaning in ("error", "height"):
            made.addSeparator()
            for title, by_height in (("By the error", False), ("By the height", True)):
                action = made.addAction(title)
                action.setCheckable(True)
                action.setChecked((self.meaning == "height") == by_height)
                action.triggered.connect(lambda _=False, on=by_height: self.height_chosen.emit(on))
        return made

    def _choose_unit(self, unit: str) -> None:
        factor = PER_METRE[unit] / PER_METRE[self._told[self.meaning]]
        self.units[self.meaning] = self._told[self.meaning] = unit
        self._chosen.add(self.meaning)
        if self.scale.by_hand is not None:
            low, high = self.scale.by_hand
            self.scaled.emit(self.scale.at(low * factor, high * factor))
        self.unit_chosen.emit()

    @property
    def bar(self) -> QRect:
        """Where the colours are, px."""
        above, below = ABOVE[self.low], BELOW[self.low]
        return QRect(LEFT, above, WIDTH, self.height() - above - below)

    @property
    def low(self) -> bool:
        """There is no room for more than the title and both ends."""
        view = self.parentWidget()
        return view is not None and view.height() < LOW

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self.menu().exec(event.globalPos())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        y = event.position().y()
        if event.button() == Qt.MouseButton.LeftButton:
            ends = {True: abs(y - self.bar.top()), False: abs(y - self.bar.bottom())}
            upper = min(ends, key=lambda end: ends[end])
            self._held, self._from = (upper if ends[upper] <= REACH_PX else None), self.limits
        event.accept()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        y, bar = event.position().y(), self.bar
        if self._held is not None:
            low, high = self._from
            # by the bar as it was when the drag began: what is under the mouse becomes the end
            value = high - (high - low) * (y - bar.top()) / bar.height()
            self.scaled.emit(self.scale.dragged(self._from, self._held, float(value)))
        near = min(abs(y - bar.top()), abs(y - bar.bottom())) <= REACH_PX
        self.setCursor(Qt.CursorShape.SizeVerCursor if near or self._held is not None else Qt.CursorShape.ArrowCursor)
        event.accept()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._held = None
        event.accept()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.scaled.emit(self.scale.as_before())
        event.accept()

    def eventFilter(self, watched: QObject, event: object) -> bool:
        if event.type() == event.Type.Resize:  # type: ignore[attr-defined]
            self._place()
        return False

    def paintEvent(self, event: QPaintEvent) -> None:
        c = theme.colours()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        back = QColor(c.window)
        back.setAlpha(215)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(back)
        painter.drawRoundedRect(QRectF(self.rect()), 6, 6)
        bar, (low, high) = self.bar, self.limits
        gradient = QLinearGradient(QPointF(bar.topLeft()), QPointF(bar.bottomLeft()))
        shades = self.scale.colours(np.linspace(high, low, 21), low, high).tolist()
        for i, (red, green, blue) in enumerate(shades):
            gradient.setColorAt(i / 20, QColor(red, green, blue))
        painter.fillRect(bar, gradient)
        painter.setPen(QColor(c.text))
        painter.drawText(QRect(12, 6, self.width() - 16, 20), Qt.AlignmentFlag.AlignLeft, self.title)
        painter.setPen(QColor(c.warning))
        if not self.low:
            note = QRect(12, self.height() - 24, self.width() - 16, 20)
            painter.drawText(note, Qt.AlignmentFlag.AlignLeft, self.note)
        painter.setPen(QColor(c.text))
        middle = ((0.5, 0.5 * (low + high)),) if bar.height() > 60 else ()
        for share, value in ((0.0, high), *middle, (1.0, low)):
            y = bar.top() + round(share * bar.height())
            painter.drawLine(bar.right() + 2, y, bar.right() + 6, y)
            box = QRect(bar.right() + 10, y - 10, self.width() - bar.right() - 12, 20)
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, f"{tick(value)} {self.unit}")
        if bar.height() > ROOM_FOR_SIDES:
            for y, side in ((bar.bottom() - 18, self.sides[0]), (bar.top() + 18, self.sides[1])):
                box = QRect(bar.right() + 10, y - 10, self.width() - bar.right() - 12, 20)
                painter.drawText(box, Qt.AlignmentFlag.AlignVCenter, side)
        painter.setBrush(QColor(c.text))
        painter.setPen(Qt.PenStyle.NoPen)
        for y in (bar.top(), bar.bottom() + 1):
            painter.drawPolygon(QPolygonF([QPointF(bar.left() - 1, y), QPointF(3.0, y - 5.0), QPointF(3.0, y + 5.0)]))

    def _place(self) -> None:
        if (view := self.parentWidget()) is not None:
            tall = 208 if view.width() > NARROW else 150
            room = view.height() - (6 if self.low else 24)
            self.resize(128 if view.width() > NARROW else 112, min(tall, room))
            self.move(view.width() - self.width() - 6, view.height() - self.height() - 6)
