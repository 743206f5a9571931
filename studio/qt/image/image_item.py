"""A picture in a pyqtgraph view: drawn from its halves when zoomed out, with a grid of pixels when zoomed in."""

from __future__ import annotations

import math
from typing import Any

import pyqtgraph as pg
from PySide6.QtCore import QLineF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QKeySequence, QPainter, QPen, QResizeEvent, QShortcut
from PySide6.QtWidgets import QStyleOptionGraphicsItem, QWidget

from render.output.tone_mapping import Picture

MARGIN = 0.01
"""About a fitted picture, as a share of it."""
GRID_FROM = 14.0
"""Screen pixels a pixel from which the grid is drawn."""


class PictureItem(pg.GraphicsObject):  # type: ignore[misc]
    """Pixel centres at integers, as everywhere: the picture covers -0.5 .. width - 0.5."""

    def __init__(self) -> None:
        super().__init__()
        self._levels: list[Picture] = []
        self._images: list[QImage] = []
        self._rect = QRectF(-0.5, -0.5, 1.0, 1.0)
        self._clip: float | None = None
        self.grid = True
        self.setFlag(self.GraphicsItemFlag.ItemUsesExtendedStyleOption)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the pixels it covers."""
        return round(self._rect.width()), round(self._rect.height())

    def set_levels(self, levels: list[Picture], size: tuple[int, int] | None = None) -> None:
        """`studio.tone.pyramid` of a picture; size: the pixels (width, height) it covers, None: its own."""
        self._levels = levels  # QImage does not own its bytes
        self._images = [
            QImage(level.data, level.shape[1], level.shape[0], 4 * level.shape[1], QImage.Format.Format_RGB32)
            for level in levels
        ]
        if levels and size is None:
            size = levels[0].shape[1], levels[0].shape[0]
        rect = QRectF(-0.5, -0.5, *(float(side) for side in size or (1, 1)))
        if rect != self._rect:
            self.prepareGeometryChange()
            self._rect = rect
        self.update()

    def set_clip(self, column: float | None) -> None:
        """Draw only what is right of a column."""
        self._clip = column
        self.update()

    def boundingRect(self) -> QRectF:
        return self._rect

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        if not self._images:
            return
        transform = painter.worldTransform()
        zoom = math.hypot(transform.m11(), transform.m12())
        full = self._images[0]
        own = zoom * self._rect.width() / full.width()
        level = min(max(0, math.floor(-math.log2(own) + 0.3)) if own > 0 else 0, len(self._images) - 1)
        image = self._images[level]
        exposed = option.exposedRect.intersected(self._rect)
        if self._clip is not None:
            exposed = exposed.intersected(
                QRectF(self._clip, self._rect.top(), self._rect.right() - self._clip, self._rect.height())
            )
        if exposed.isEmpty():
            return
        # only the visible part, or Qt scales gigapixels at high zoom
        sx, sy = image.width() / self._rect.width(), image.height() / self._rect.height()
        source = QRectF(
            (exposed.left() - self._rect.left()) * sx,
            (exposed.top() - self._rect.top()) * sy,
            exposed.width() * sx,
            exposed.height() * sy,
        )
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, own < 1.0)
        painter.drawImage(exposed, image, source)
        if self.grid and zoom >= GRID_FROM:
            self._paint_grid(painter, exposed, zoom)

    def _paint_grid(self, painter: QPainter, rect: QRectF, zoom: float) -> None:
        strength = min(1.0, (zoom - GRID_FROM) / GRID_FROM)
        pen = QPen(QColor(128, 128, 128, round(30 + 70 * strength)), 0.0)
        pen.setCosmetic(True)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        painter.setPen(pen)
        columns = range(math.ceil(rect.left() + 0.5), math.floor(rect.right() + 0.5) + 1)
        rows = range(math.ceil(rect.top() + 0.5), math.floor(rect.bottom() + 0.5) + 1)
        lines = [QLineF(column - 0.5, rect.top(), column - 0.5, rect.bottom()) for column in columns]
        lines += [QLineF(rect.left(), row - 0.5, rect.right(), row - 0.5) for row in rows]
        painter.drawLines(lines)


class PictureBox(pg.ViewBox):  # type: ignore[misc]
    """A drag moves the picture; with Shift it chooses a part of it."""

    boxed = Signal(object, object, bool)
    """Columns and rows where the drag began and is, and whether it is over."""

    def mouseDragEvent(self, event: Any, axis: int | None = None) -> None:
        shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if axis is not None or event.button() != Qt.MouseButton.LeftButton or not shift:
            super().mouseDragEvent(event, axis)
            return
        event.accept()
        begin, end = (self.mapToView(place) for place in (event.buttonDownPos(), event.pos()))
        self.boxed.emit((begin.x(), end.x()), (begin.y(), end.y()), event.isFinish())


class PictureView(pg.GraphicsView):  # type: ignore[misc]
    """A view box in pixel coordinates, v downwards: wheel zooms at the cursor, drag pans, F shows the whole picture."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.box = PictureBox(lockAspect=True, invertY=True, enableMenu=False, defaultPadding=0.01)
        self.setCentralItem(self.box)
        self.item = PictureItem()
        self.box.addItem(self.item)
        self.setBackground(self.palette().color(self.backgroundRole()))
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        QShortcut(QKeySequence("F"), self, self.fit, context=Qt.ShortcutContext.WidgetWithChildrenShortcut)

    def resizeEvent(self, event: QResizeEvent | None) -> None:
        fitted = hasattr(self, "item") and self._is_fitted(*self.item.size)
        super().resizeEvent(event)
        if fitted:
            self.fit()

    def fit(self) -> None:
        """The whole picture; it stays whole in a view of another size, until a person zooms."""
        self.box.setRange(self.item.boundingRect(), padding=MARGIN)

    def _is_fitted(self, width: int, height: int) -> bool:
        """The view shows a picture of this size whole, and as large as it can."""
        seen, whole = self.box.viewRect(), QRectF(-0.5, -0.5, width, height)
        return bool(seen.contains(whole) and min(seen.width() / width, seen.height() / height) < 1.0 + 3.0 * MARGIN)

    def one_to_one(self) -> None:
        """One screen pixel a pixel, about the middle of what is seen."""
        centre = self.box.viewRect().center()
        ratio = self.devicePixelRatioF()
        width, height = self.box.width() / ratio, self.box.height() / ratio
        self.box.setRange(QRectF(centre.x() - width / 2, centre.y() - height / 2, width, height), padding=0.0)

    @property
    def zoom(self) -> float:
        """Screen pixels a pixel."""
        width = self.box.viewRect().width()
        return self.box.width() / width if width > 0 else 1.0

    def keep_place(self, before: tuple[int, int], now: tuple[int, int]) -> None:
        """Show the same part of a picture whose size in pixels has changed; all of one of another shape."""
        if self._is_fitted(*before) or not _alike(before, now):
            self.fit()
            return
        sx, sy = now[0] / before[0], now[1] / before[1]
        rect = self.box.viewRect()
        self.box.setRange(
            QRectF((rect.x() + 0.5) * sx - 0.5, (rect.y() + 0.5) * sy - 0.5, rect.width() * sx, rect.height() * sy),
            padding=0.0,
        )


def _alike(before: tuple[int, int], now: tuple[int, int]) -> bool:
    """One is the other at another scale, but for the rounding of its sides."""
    return abs(before[0] * now[1] - now[0] * before[1]) <= 0.5 * (sum(before) + sum(now))
