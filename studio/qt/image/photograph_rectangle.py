"""The rectangle of a photograph that alone is looked at: drawn upon it, dragged by its sides and corners, or typed."""

from __future__ import annotations

from typing import Any

import pyqtgraph as pg
from pyqtgraph.graphicsItems.ROI import Handle
from PySide6.QtCore import QPointF, QRectF, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import QCheckBox, QGridLayout, QLabel, QWidget

from studio.photographs.region import SMALLEST, Region
from studio.qt.core.boxes import WholeBox
from studio.qt.image.image_item import PictureView

Box = tuple[int, int, int, int]
"""Left, top, width and height, px."""
TIP = "Drag it, its sides and its corners in the photograph, or draw another with Shift held down"
HOW = "Shift + drag in the photograph draws one"
NAMES = ("Left", "Top", "Width", "Height")
WIDEST = 1_000_000
"""px; no photograph has more."""
GRIP, REACH = 6, 6.0
"""px on the screen: half a grip, and the distance from a side within which a drag moves that side."""
SHARE = 0.5
"""Of the photograph's sides, those of the first rectangle."""
SIZING = {
    (0.0, 0.0): Qt.CursorShape.SizeFDiagCursor,
    (0.5, 0.0): Qt.CursorShape.SizeVerCursor,
    (1.0, 0.0): Qt.CursorShape.SizeBDiagCursor,
    (1.0, 0.5): Qt.CursorShape.SizeHorCursor,
    (1.0, 1.0): Qt.CursorShape.SizeFDiagCursor,
    (0.5, 1.0): Qt.CursorShape.SizeVerCursor,
    (0.0, 1.0): Qt.CursorShape.SizeBDiagCursor,
    (0.0, 0.5): Qt.CursorShape.SizeHorCursor,
}
"""The grips by their place on the rectangle, and what the mouse looks like on them."""


class Grip(Handle):  # type: ignore[misc]
    """A square of one size on the screen, to be seen on any photograph."""

    def __init__(self, outline: Outline, cursor: Qt.CursorShape) -> None:
        super().__init__(GRIP, "t", pen="k", hoverPen="y", parent=outline)
        self.setCursor(cursor)

    def paint(self, painter: QPainter, *_: Any) -> None:
        painter.setPen(pg.mkPen("k"))
        painter.setBrush(pg.mkBrush("w" if self.currentPen is self.pen else "y"))
        painter.drawPath(self.shape())


class Outline(pg.ROI):  # type: ignore[misc]
    """The rectangle in the view: white in a black border, with a grip on every side and corner."""

    def __init__(self) -> None:
        super().__init__((0, 0), (1, 1), rotatable=False)
        self.setCursor(Qt.CursorShape.SizeAllCursor)
        self.grips: dict[tuple[float, float], Grip] = {}
        for place, cursor in SIZING.items():
            self.grips[place] = Grip(self, cursor)
            self.addScaleHandle(place, (1.0 - place[0], 1.0 - place[1]), item=self.grips[place])
        self._dragged: Grip | None = None
        self.keep_within(1, 1)

    def paint(self, painter: QPainter, *_: Any) -> None:
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        for colour, width in (("k", 4), ("y" if self.mouseHovering else "w", 2)):
            painter.setPen(pg.mkPen(colour, width=width))
            painter.drawRect(QRectF(0.0, 0.0, *self.state["size"]))

    def keep_within(self, width: int, height: int) -> None:
        """No drag takes it out of a photograph of so many pixels."""
        self.within = self.maxBounds = QRectF(-0.5, -0.5, width, height)

    def movePoint(
        self, handle: Any, pos: Any, modifiers: Any = None, finish: bool = True, coords: str = "parent"
    ) -> None:
        # a drag that leaves the photograph ends at its border, where pyqtgraph drops it
        at = self.mapSceneToParent(pos) if coords == "scene" else QPointF(pos)
        within = self.within
        x = min(max(at.x(), within.left()), within.right())
        y = min(max(at.y(), within.top()), within.bottom())
        self.maxBounds = within.adjusted(-0.1, -0.1, 0.1, 0.1)  # for rounding
        super().movePoint(handle, QPointF(x, y), Qt.KeyboardModifier.NoModifier, finish)
        self.maxBounds = within

    def hoverEvent(self, event: Any) -> None:
        # a drag with Shift is the view's, which draws another rectangle
        if event.isExit() or not event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            super().hoverEvent(event)

    def mouseDragEvent(self, event: Any) -> None:
        """By a side that side, elsewhere all of it."""
        if event.isStart() and event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            event.ignore()
            return
        if event.isStart():
            self._dragged = self._side_at(event.buttonDownPos())
        if self._dragged is not None:
            self._dragged.mouseDragEvent(event)
        else:
            super().mouseDragEvent(event)

    def _side_at(self, place: QPointF) -> Grip | None:
        """place: in the rectangle, px of the photograph."""
        width, height = self.state["size"]
        along, across = (REACH * size for size in self.pixelSize())
        x = 0.0 if place.x() < along else 1.0 if place.x() > width - along else 0.5
        y = 0.0 if place.y() < across else 1.0 if place.y() > height - across else 0.5
        return self.grips.get((x, y))


class PhotographRectangle(QWidget):
    """Whether there is one, and its numbers; `outline` is the same in the view."""

    changed = Signal()

    def __init__(self, view: PictureView) -> None:
        super().__init__()
        self.view = view
        self.box: Box | None = None
        """None: none was chosen yet."""
        self.limited = QCheckBox("Only within the rectangle")
        self.limited.setToolTip(TIP)
        self.boxes = tuple(WholeBox(maximum=WIDEST, keyboardTracking=False, suffix=" px") for _ in NAMES)
        self.outline = Outline()
        self.outline.setZValue(20)  # above the line that is drawn upon the photograph
        self.outline.setVisible(False)
        view.box.addItem(self.outline, ignoreBounds=True)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.limited, 0, 0, 1, 4)
        for k, (name, box) in enumerate(zip(NAMES, self.boxes, strict=True)):
            box.setAccessibleName(f"{name} of the rectangle")
            box.setEnabled(False)
            layout.addWidget(QLabel(name), 1 + k // 2, 2 * (k % 2))
            layout.addWidget(box, 1 + k // 2, 1 + 2 * (k % 2))
            layout.setColumnStretch(1 + 2 * (k % 2), 1)
            box.valueChanged.connect(self._take_numbers)
        self.how = QLabel(HOW)
        self.how.setObjectName("muted")
        self.how.setToolTip(TIP)
        layout.addWidget(self.how, 3, 0, 1, 4)
        self.limited.toggled.connect(self._limit)
        self.outline.sigRegionChanged.connect(self._follow_outline)
        self.outline.sigRegionChangeFinished.connect(lambda *_: self.put(self.box))
        view.box.boxed.connect(self._draw)

    def region(self) -> Region:
        """What is looked at: all, or the rectangle."""
        return Region(self.box) if self.limited.isChecked() else Region()

    def clear(self) -> None:
        """None, as before the first photograph."""
        self.box = None
        self.limited.setChecked(False)

    def follow_picture(self) -> None:
        """Another photograph is in the view."""
        self.outline.keep_within(*self.view.item.size)
        if self.box is None and self.limited.isChecked():
            self._limit(True)

    def put(self, box: Box | None) -> None:
        """Another rectangle, as far as it is in the photograph."""
        width, height = self.view.item.size
        if box is None or min(width, height) < SMALLEST:
            return
        left, top = (min(max(at, 0), side - SMALLEST) for at, side in zip(box[:2], (width, height), strict=True))
        self.box = left, top, max(SMALLEST, min(box[2], width - left)), max(SMALLEST, min(box[3], height - top))
        with QSignalBlocker(self.outline):
            self.outline.setPos((left - 0.5, top - 0.5), update=False)
            self.outline.setSize(self.box[2:])
        self._show_numbers()
        self.changed.emit()

    def _limit(self, on: bool) -> None:
        width, height = self.view.item.size
        if on and self.box is None:
            self.put(tuple(round(side * share) for share in (0.5 - 0.5 * SHARE, SHARE) for side in (width, height)))  # type: ignore[arg-type]
        self.outline.setVisible(on and self.box is not None)
        for box in self.boxes:
            box.setEnabled(on)
        self.changed.emit()

    def _take_numbers(self) -> None:
        left, top, width, height = (box.value() for box in self.boxes)
        self.put((left, top, width, height))

    def _follow_outline(self) -> None:
        (x, y), (w, h) = self.outline.pos(), self.outline.size()
        left, top = round(x + 0.5), round(y + 0.5)
        self.box = max(left, 0), max(top, 0), round(x + w + 0.5) - left, round(y + h + 0.5) - top
        self._show_numbers()
        self.changed.emit()

    def _show_numbers(self) -> None:
        for box, value in zip(self.boxes, self.box or (), strict=True):
            with QSignalBlocker(box):
                box.setValue(value)

    def _draw(self, columns: tuple[float, float], rows: tuple[float, float], over: bool) -> None:
        ends = [sorted(round(at + 0.5) for at in pair) for pair in (columns, rows)]
        sides = self.view.item.size
        (left, right), (top, bottom) = (
            (max(low, 0), min(high, side)) for (low, high), side in zip(ends, sides, strict=True)
        )
        self.put((left, top, right - left, bottom - top))
        self.limited.setChecked(self.box is not None)
