"""The guided tour: a few steps over the sample, each pointing at one panel; it can be left at any moment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QVBoxLayout, QWidget

from studio.qt.core import theme


@dataclass(frozen=True)
class Step:
    """One stop: the workspace it is in, the panel it points at ("" for the whole window), what it says."""

    workspace: str
    panel: str
    title: str
    text: str


STEPS = (
    Step(
        "setup",
        "",
        "What will this scanner see?",
        "This is a camera and a line laser over a welded joint. In six steps you see how to place them, render what "
        "the sensor delivers, and read how wrong the measured points are.",
    ),
    Step(
        "setup",
        "viewport",
        "Place",
        "Click a thing to select it and drag its handles. The laser's sheet, the lit line and the read-outs follow "
        "while you drag.",
    ),
    Step(
        "setup",
        "inspector",
        "Or type",
        "Every value of the selection, with its unit and its limits. Drag on a number, or type it. Presets hold "
        "common sensors and lasers. Everything can be undone.",
    ),
    Step(
        "setup",
        "readout",
        "Judge the design",
        "Resolution, line width, exposure, occlusion and the depth noise to expect, while you move things. No "
        "rendering is needed for that.",
    ),
    Step(
        "render",
        "render",
        "Render",
        "F5 renders the frame until its own noise no longer matters for the depth, or as far as you choose. Watch "
        "it fall; pause or stop when it is good enough.",
    ),
    Step(
        "render",
        "develop",
        "Change the exposure afterwards",
        "Exposure, gain, laser power and noise are applied to the stored light in milliseconds: no new render.",
    ),
    Step(
        "measure",
        "results",
        "See the error",
        "The extracted line against the exact one: by scan line, as a profile, as a histogram, by three methods. "
        "Point at a scan line and it is marked in every view. F1 explains each panel.",
    ),
)
SHADE = 120
MARGIN = 14


class Tour(QWidget):
    """Lies over the window; `ended` when it was finished or skipped."""

    ended = Signal()

    def __init__(self, window: QWidget, place: Callable[[Step], QWidget | None]) -> None:
        """place: brings a step's panel to the front and returns it."""
        super().__init__(window)
        self.window_under = window
        self.setObjectName("tour")
        self.place, self.index = place, 0
        self.target: QWidget | None = None
        self.card = QFrame(self)
        self.card.setObjectName("card")
        self.card.setFixedWidth(360)
        self.title, self.text, self.count = QLabel(), QLabel(wordWrap=True), QLabel()
        self.count.setObjectName("muted")
        self.skip, self.back, self.next = QPushButton("Skip"), QPushButton("Back"), QPushButton("Next")
        self.next.setDefault(True)
        self.skip.clicked.connect(self.end)
        self.back.clicked.connect(lambda: self.go(self.index - 1))
        self.next.clicked.connect(lambda: self.go(self.index + 1))
        row = QHBoxLayout()
        row.addWidget(self.skip)
        row.addStretch(1)
        for widget in (self.count, self.back, self.next):
            row.addWidget(widget)
        inside = QVBoxLayout(self.card)
        inside.setContentsMargins(18, 14, 18, 14)
        for widget in (self.title, self.text):
            inside.addWidget(widget)
        inside.addSpacing(8)
        inside.addLayout(row)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        window.installEventFilter(self)
        theme.notice.changed.connect(self._paint_card)
        self._paint_card()
        self.go(0)
        self.show()
        self.raise_()
        self.next.setFocus()

    def go(self, index: int) -> None:
        """Another step; beyond the last one the tour ends."""
        if index >= len(STEPS):
            self.end()
            return
        self.index = max(0, index)
        step = STEPS[self.index]
        self.target = self.place(step)
        self.title.setText(f"<span style='font-size: 13pt; font-weight: 600'>{step.title}</span>")
        self.text.setText(step.text)
        self.count.setText(f"{self.index} of {len(STEPS) - 1} " if self.index else "")
        self.back.setEnabled(self.index > 0)
        self.next.setText("Done" if self.index == len(STEPS) - 1 else "Next")
        self.raise_()
        self._fit()

    def end(self) -> None:
        """Finished or skipped."""
        self.window_under.removeEventFilter(self)
        self.hide()
        self.ended.emit()
        self.deleteLater()

    def hole(self) -> QRect:
        """Where the panel of the step is, in the window."""
        if self.target is None or not self.target.isVisible():
            return QRect()
        corner = self.target.mapTo(self.window_under, QPoint(0, 0))
        return QRect(corner, self.target.size()).intersected(self.rect())

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() in (QEvent.Type.Resize, QEvent.Type.LayoutRequest):
            self._fit()
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Right, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.go(self.index + 1)
        elif event.key() == Qt.Key.Key_Left:
            self.go(self.index - 1)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        hole = self.hole()
        shade = QColor(0, 0, 0, SHADE)
        whole = self.rect()
        if hole.isNull():
            painter.fillRect(whole, shade)
            return
        for part in (
            QRect(whole.left(), whole.top(), whole.width(), hole.top()),
            QRect(whole.left(), hole.bottom() + 1, whole.width(), whole.height() - hole.bottom() - 1),
            QRect(whole.left(), hole.top(), hole.left(), hole.height()),
            QRect(hole.right() + 1, hole.top(), whole.width() - hole.right() - 1, hole.height()),
        ):
            painter.fillRect(part, shade)
        painter.setPen(QPen(QColor(theme.colours().accent), 2))
        painter.drawRect(hole.adjusted(1, 1, -1, -1))

    def _fit(self) -> None:
        """Cover the window; the card beside the panel, where there is room."""
        self.setGeometry(self.window_under.rect())
        self.card.adjustSize()
        size, hole, room = self.card.size(), self.hole(), self.rect().adjusted(MARGIN, MARGIN, -MARGIN, -MARGIN)
        place = QRect(QPoint(0, 0), size)
        place.moveCenter(self.rect().center())
        if not hole.isNull():
            centre = hole.center()
            for corner in (
                QPoint(hole.right() + MARGIN, centre.y() - size.height() // 2),
                QPoint(hole.left() - MARGIN - size.width(), centre.y() - size.height() // 2),
                QPoint(centre.x() - size.width() // 2, hole.top() - MARGIN - size.height()),
                QPoint(centre.x() - size.width() // 2, hole.bottom() + MARGIN),
            ):
                tried = QRect(corner, size)
                tried.moveTop(min(max(tried.top(), room.top()), room.bottom() - size.height()))
                if room.contains(tried) and not tried.intersects(hole):
                    place = tried
                    break
            else:
                place.moveCenter(hole.center())
        self.card.move(place.topLeft())
        self.update()

    def _paint_card(self) -> None:
        c = theme.colours()
        self.card.setStyleSheet(
            f"#card {{ background: {c.raised}; border: 1px solid {c.accent}; border-radius: 8px; }}"
        )
