"""The contact sheet: the first scenes of the recipe as they become ready, or images that were written, with their exact
lines."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QHelpEvent, QHideEvent, QImage, QMouseEvent, QPainter, QPaintEvent, QShowEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QToolTip, QVBoxLayout, QWidget

from studio.dataset.contact_sheet import LINE, Picture
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.session import Session, one_of
from studio.qt.dataset.dataset_work import DatasetWork
from studio.qt.dataset.large_picture import LargePicture

GAP = 6
LINE_WIDTH = 1.5
SIMPLER = "So small, gloss and curves are rougher than in the images: a double click shows one as it will be."


class ContactPanel(QWidget):
    """The sheet, and what is to say about it."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.work = one_of(DatasetWork, session)
        self.sheet = Sheet(self.work)
        self.choice = ChoiceBox()
        self.choice.addItems(("Preview of the recipe", "Images in the folder"))
        self.choice.setAccessibleName("What the sheet shows")
        self.choice.setToolTip("The scenes that a run would make, or the first images that are there")
        self.told = QLabel(wordWrap=True)
        self.told.setObjectName("muted")
        self.problem = QLabel(wordWrap=True)
        self.problem.setObjectName("error")
        self.problem.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(8, 8, 8, 8)
        layout.addWidget(self.choice, 0, Qt.AlignmentFlag.AlignLeft)
        layout.addWidget(self.problem)
        layout.addWidget(self.sheet, 1)
        layout.addWidget(self.told)
        self.choice.activated.connect(lambda number: self.work.show_written(number == 1))
        self.sheet.opened.connect(self.open_large)
        self.work.pictures_changed.connect(self._follow)
        self._follow()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.work.look()

    def hideEvent(self, event: QHideEvent) -> None:
        self.work.watched = False
        super().hideEvent(event)

    def open_large(self, picture: Picture) -> LargePicture:
        """In a window of its own."""
        large = LargePicture(self.work, picture, self)
        large.show()
        return large

    def _follow(self) -> None:
        work = self.work
        self.problem.setText(work.problem)
        self.problem.setVisible(bool(work.problem))
        self.choice.setVisible(bool(work.written))
        self.choice.setCurrentIndex(1 if work.shows_written else 0)
        self.told.setText(self._written() if work.shows_written else self._previewed())
        self.sheet.update()

    def _written(self) -> str:
        work = self.work
        count, name = len(work.written), "" if work.folder is None else work.folder.name
        which = "The image" if count == 1 else f"The first {count} images"
        line = "The exact line of their labels is drawn on the upper half"
        return f"{which} of the folder {name}, as written. {line}, and dark parts are brightened."

    def _previewed(self) -> str:
        work = self.work
        anew = sum(len(picture.rejected) for picture in work.pictures.values())
        of_all = work.previewed
        made = sum(number < of_all for number in work.pictures)
        which = f"the first {of_all} scenes of the recipe" if of_all < work.scenes else f"the {of_all} scenes"
        drawn = f"Preview: {which}" + (f", {made} of them so far" if made < of_all else "")
        again = f"; {anew} were drawn anew, as they showed no line" if anew else ""
        return f"{drawn}{again}. The exact line is drawn on the upper half. {SIMPLER}"


class Sheet(QWidget):
    """The pictures in rows that fill the widget."""

    opened = Signal(object)
    """A picture, to be looked at large."""

    def __init__(self, work: DatasetWork) -> None:
        super().__init__()
        self.work = work
        self.setMinimumSize(240, 160)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("Contact sheet")

    def sizeHint(self) -> QSize:
        return QSize(720, 480)

    def place(self, number: int) -> QRectF:
        """Where the picture of a scene stands."""
        picture = next(iter(self.work.on_sheet.values()), None)
        height, width = picture.values.shape if picture is not None else (5, 6)
        columns = self._columns(width / height)
        cell = (self.width() - GAP * (columns - 1)) / columns
        row, column = divmod(number, columns)
        return QRectF(column * (cell + GAP), row * (cell * height / width + GAP), cell, cell * height / width)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        pictures = self.work.on_sheet
        for number in range(self.work.places):
            place = self.place(number)
            picture = pictures.get(number)
            if picture is None:
                painter.fillRect(place, self.palette().alternateBase())
            else:
                _paint(painter, place, picture)

    def picture_at(self, point: QPointF) -> Picture | None:
        """None: there is none, or none yet."""
        return next((one for number, one in self.work.on_sheet.items() if self.place(number).contains(point)), None)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        picture = self.picture_at(event.position())
        if picture is not None:
            self.opened.emit(picture)

    def event(self, event: QEvent) -> bool:
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            picture = self.picture_at(QPointF(event.pos()))
            if picture is not None:
                anew = f"; drawn anew: {', '.join(picture.rejected)}" if picture.rejected else ""
                what = "image" if self.work.shows_written else "scene"
                told = f"{what} {picture.number}{anew}. A double click shows it large"
                QToolTip.showText(event.globalPos(), told, self)
                return True
        return super().event(event)

    def _columns(self, aspect: float) -> int:
        """As few as let all pictures fit into the height."""
        for columns in range(1, self.work.places + 1):
            rows = -(-self.work.places // columns)
            cell = (self.width() - GAP * (columns - 1)) / columns
            if rows * cell / aspect + GAP * (rows - 1) <= self.height():
                return columns
        return self.work.places


def _paint(painter: QPainter, place: QRectF, picture: Picture) -> None:
    grey = np.ascontiguousarray(255.0 * np.clip(picture.values, 0.0, 1.0), dtype=np.uint8)
    height, width = grey.shape
    image = QImage(grey.data, width, height, width, QImage.Format.Format_Grayscale8)
    painter.drawImage(place, image)
    painter.save()
    painter.translate(place.topLeft())
    painter.scale(place.width() / width, place.height() / height)
    pen = painter.pen()
    pen.setColor(QColor(LINE))
    pen.setWidthF(LINE_WIDTH)
    pen.setCosmetic(True)
    painter.setPen(pen)
    for curve in picture.curves:
        upper = slice(0, len(curve.index) // 2)  # the other half shows the line itself
        along, position = curve.index[upper] + 0.5, curve.position[upper] + 0.5  # centres of pixels, from their corner
        x, y = (position, along) if curve.axis == "rows" else (along, position)
        painter.drawPoints([QPointF(*pair) for pair in zip(x.tolist(), y.tolist(), strict=True)])
    painter.restore()
