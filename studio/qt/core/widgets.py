"""Small widgets that several panels are made of."""

from __future__ import annotations

import re

from PySide6.QtCore import QEvent, QMargins, QObject, QSize, Qt, QTimer
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QBoxLayout,
    QFormLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QSplitter,
    QWidget,
)

THOUSANDTHS = 1000
LONG_WORD = 30
"""Characters, more than a board or a number with its unit that a person may copy."""
FRAME = QMargins(2, 32, 2, 2)
"""px of the screen that a title bar and borders take, about."""


def room_for_a_window(widget: QWidget) -> QSize:
    """What the widget's screen has beside panels of the desktop and the window's frame."""
    return widget.screen().availableSize().shrunkBy(FRAME)


class ElidedLabel(QLabel):
    """One line that may have too little room: it is shortened then, and its tip has the whole."""

    def __init__(self, mode: Qt.TextElideMode = Qt.TextElideMode.ElideRight) -> None:
        super().__init__()
        self.mode = mode
        self.setMinimumWidth(1)

    def setText(self, text: str) -> None:
        super().setText(text)
        self.setToolTip(text)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter, area = QPainter(self), self.contentsRect()
        shown = self.fontMetrics().elidedText(self.text(), self.mode, area.width())
        self.style().drawItemText(
            painter, area, int(self.alignment()), self.palette(), self.isEnabled(), shown, self.foregroundRole()
        )


def keep_room(label: QLabel, lines: int) -> None:
    """For so many lines at least, also while it is hidden: what stands below stays where it is as the text changes."""
    label.setMinimumHeight(lines * label.fontMetrics().lineSpacing())
    label.setAlignment(Qt.AlignmentFlag.AlignTop)
    keep_size(label)


def keep_size(widget: QWidget) -> None:
    """Its room, also while it is hidden."""
    policy = widget.sizePolicy()
    policy.setRetainSizeWhenHidden(True)
    widget.setSizePolicy(policy)


def no_higher(*widgets: QWidget) -> None:
    """Than they need: what room is left is another's."""
    for widget in widgets:
        policy = widget.sizePolicy()
        policy.setVerticalPolicy(QSizePolicy.Policy.Maximum)
        widget.setSizePolicy(policy)


def text_button(text: str, tip: str = "", name: str = "") -> QPushButton:
    """name: for the style sheet."""
    button = QPushButton(text)
    button.setObjectName(name)
    button.setToolTip(tip)
    return button


def align_labels(*forms: QFormLayout) -> None:
    """Make the fields of forms that stand under each other begin at one place."""
    labels = []
    for form in forms:
        items = (form.itemAt(row, QFormLayout.ItemRole.LabelRole) for row in range(form.rowCount()))
        labels += [widget for item in items if item is not None and (widget := item.widget()) is not None]
    width = max(label.sizeHint().width() for label in labels)
    for label in labels:
        label.setMinimumWidth(width)


class ShareBar(QProgressBar):
    """How far a job is; its words stand beside it."""

    def __init__(self, height: int = 10) -> None:
        """height: px at most."""
        super().__init__(maximum=THOUSANDTHS, textVisible=False)
        self.setMaximumHeight(height)

    def show_share(self, done: float) -> None:
        """done: 0..1; of 0 it is not known how far the job is, and the bar runs to and fro.

        It is drawn with all else that changes: by itself Qt would draw it at once, and the whole window with it, as
        that holds 3D.
        """
        most, value = (THOUSANDTHS, round(THOUSANDTHS * done)) if done > 0.0 else (0, 0)
        if (most, value) != (self.maximum(), self.value()):
            self.setUpdatesEnabled(False)
            self.setMaximum(most)
            self.setValue(value)
            self.setUpdatesEnabled(True)

    def show_none(self) -> None:
        """No job."""
        self.setMaximum(THOUSANDTHS)
        self.setValue(0)


def flush(layout: QBoxLayout, *widgets: QWidget) -> QBoxLayout:
    """Fill a layout edge to edge, without room around or between."""
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    for widget in widgets:
        layout.addWidget(widget)
    return layout


def upper_and_lower(upper: QWidget, lower: QWidget, sizes: tuple[int, int]) -> QSplitter:
    """Two widgets with a line between them that can be dragged; of more height the upper one takes three quarters."""
    split = QSplitter(Qt.Orientation.Vertical)
    for widget, share in ((upper, 3), (lower, 1)):
        split.addWidget(widget)
        split.setStretchFactor(split.indexOf(widget), share)
    split.setSizes(list(sizes))
    return split


class Scrolled(QScrollArea):
    """A low screen shows a part of a panel, and the window does not outgrow it; never narrower than what it holds."""

    def __init__(self, panel: QWidget) -> None:
        super().__init__(widgetResizable=True)
        self.setFrameShape(QScrollArea.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.panel = panel
        self.setWidget(panel)
        self._widen()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.panel and event.type() == QEvent.Type.LayoutRequest:
            self._widen()
        return super().eventFilter(watched, event)

    def _widen(self) -> None:
        self.setMinimumWidth(self.panel.minimumSizeHint().width() + self.verticalScrollBar().sizeHint().width())


def bring_into_view(widget: QWidget) -> None:
    """Scroll to it, as soon as it stands where it will, if it is in something that scrolls."""

    def scroll() -> None:
        area = widget.parentWidget()
        while area is not None and not isinstance(area, QScrollArea):
            area = area.parentWidget()
        if area is not None:
            area.ensureWidgetVisible(widget)

    QTimer.singleShot(0, widget, scroll)


def spring() -> QWidget:
    """Takes what room is left in a bar."""
    made = QWidget()
    made.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
    return made


def breakable(text: str) -> str:
    """The text with places in its longest words, after colons and slashes, where a label may break its lines."""
    return re.sub(rf"\S{{{LONG_WORD},}}", _with_breaks, text)


def _with_breaks(word: re.Match[str]) -> str:
    return re.sub(r"([:/\\])(?=.)", "\\1\u200b", word[0])
