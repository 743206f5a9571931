"""The design read-outs of a laser, live while anything is dragged."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QLabel,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.preview.readout_rows import Row, rows
from studio.preview.readouts import readouts
from studio.qt.core import theme
from studio.qt.core.laser_box import LaserBox
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session
from studio.qt.core.widgets import ElidedLabel, keep_size
from studio.qt.results.placing_fields import PlacingField, PlacingFields
from studio.qt.results.remedy_list import RemedyList, sentence

NO_LASER, LOADING = "Add a laser to the rig to see what it measures.", "Loading meshes…"
LEAST_NAME = 72
"""px of the name of a read-out, where there is too little room for the whole."""
LEFT, SPACING, RIGHT = 10, 8, 4
"""px before a name, between it, its value, its range and what would fix it, and after."""


class ReadoutPanel(QWidget):
    """One compact row for each read-out; its tool tip explains it, its colour says when it is out of range."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._session, self._live = session, live(session)
        self._lasers = LaserBox(session)
        self._lasers.setToolTip("The laser that the read-outs are of")
        self._hint = QLabel(NO_LASER, wordWrap=True)
        self.step = QLabel(wordWrap=True)
        self.step.setObjectName("muted")
        self.problem = QLabel("Not of the scene as it is set: the scene tree marks what cannot be.", wordWrap=True)
        self.problem.setObjectName("warning")
        self._hint.setObjectName("muted")
        self._narrow = False
        """Ranges stand below their values."""
        self._long: set[str] = set()
        """Rows whose ranges have no room below their values alone, and begin below their names."""
        self._labels: dict[str, tuple[ElidedLabel, QLabel | PlacingField, ElidedLabel]] = {}
        inner = QFrame()
        column = QVBoxLayout(inner)
        column.setContentsMargins(LEFT, 8, RIGHT, 8)
        self._grid = QGridLayout()
        column.addLayout(self._grid)
        self.fixes = RemedyList(session)
        self.placing = PlacingFields(session, inner)
        self._fix: dict[str, QToolButton] = {}
        """Seen in the rows that something would fix."""
        column.addWidget(self.fixes)
        column.addStretch(1)
        self._grid.setHorizontalSpacing(SPACING)
        self._grid.setVerticalSpacing(5)
        self._grid.setColumnStretch(2, 1)
        area = QScrollArea(widgetResizable=True)
        area.setFrameShape(QFrame.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        area.setWidget(inner)
        self._area = area
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        for widget in (self._lasers, self._hint, self.problem, self.step):
            layout.addWidget(widget)
        layout.addWidget(area, 1)
        for label in (self._hint, self.problem, self.step):
            label.setContentsMargins(10, 6, 10, 0)
        self._live.changed.connect(self._refresh)
        session.problems_changed.connect(self._refresh)
        session.document_replaced.connect(self._start_anew)
        self._lasers.chosen.connect(self._refresh)
        theme.notice.changed.connect(self._paint)
        self.fixes.changed.connect(self._offer_fixes)
        self._rows: tuple[Row, ...] = ()
        self._refresh()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_notes()

    def _fit_notes(self) -> None:
        """Ranges below their values where one of them has no room beside."""
        widths = [[label.sizeHint().width() for label in self._labels[row.key]] for row in self._rows]
        fix = max((button.sizeHint().width() for button in self._fix.values()), default=0)
        # also while no button is seen, as one that comes would else move the fields from under the mouse
        wanted = sum(map(max, zip(*widths, strict=True)), LEFT + RIGHT + 3 * SPACING + fix) if widths else 0
        inside = self.width() - self._area.verticalScrollBar().sizeHint().width()
        room = inside - LEFT - RIGHT - SPACING - max((name for name, *_ in widths), default=0)
        long = {row.key for row, (*_, note) in zip(self._rows, widths, strict=True) if note > room}
        narrow = inside < wanted
        if (narrow, long) != (self._narrow, self._long):
            self._narrow, self._long = narrow, long
            for row, (key, (_, _, note)) in enumerate(self._labels.items()):
                self._place(row, note, self._fix[key], key in long)

    def rows(self) -> tuple[Row, ...]:
        """What is shown."""
        return self._rows

    @property
    def laser(self) -> int:
        """Index of the laser that is read out."""
        return self._lasers.laser

    def _start_anew(self) -> None:
        """Without the figures of another project."""
        self._rows = ()
        self._refresh()

    def _refresh(self) -> None:
        look = self._live.look
        names = [laser.name for laser in look.scene.lasers]
        self._lasers.show_names(names)
        # as long as some of the meshes are there, and nothing was read out before, figures would be of another scene
        loading = bool(names) and not self._rows and self._live.is_loading
        self._hint.setText(LOADING if loading else NO_LASER)
        self._hint.setVisible(loading or not names)
        count = look.scene.frame_count
        self.step.setText(f"As it stands at step {look.step + 1} of {count}")
        self.step.setVisible(bool(names) and count > 1)
        self.problem.setVisible(bool(names and self._session.problems))
        self._area.setVisible(bool(names))
        found = readouts(look, self.laser) if names and self._live.ready and not loading else None
        shown = () if found is None else rows(found)
        if found is not None:
            self.placing.show_values(look, self.laser, found)
        if shown != self._rows:
            self._rows = shown
            self._paint()
        self.fixes.follow(self.laser, any(row.level for row in shown))

    def _paint(self) -> None:
        colours = theme.colours()
        keys = {row.key for row in self._rows}
        for key, labels in self._labels.items():
            for label in labels:
                label.setVisible(key in keys)
        tints = {"": colours.text, "warning": colours.warning, "error": colours.error}
        for row in self._rows:
            name, value, note = self._labels.get(row.key) or self._add(row.key)
            name.setText(row.label)
            if isinstance(value, QLabel):
                value.setText(row.value)
            note.setText(row.note)
            if row.note:
                # a range that comes and goes would move the fields below from under the mouse
                keep_size(note)
            note.setVisible(bool(row.note))
            told = f"<p>{row.label}: {row.help}</p>" + (f"<p>{row.note}</p>" if row.note else "")
            for label, style in (
                (name, f"QLabel {{ color: {colours.muted} }}"),
                (value, f"QLabel {{ color: {tints[row.level]}; font-weight: 600 }}"),
                (note, f"QLabel {{ color: {colours.muted} }}"),
            ):
                if not isinstance(label, QLabel):
                    label.explain(told)
                    label.mark(row.level)
                    continue
                label.setToolTip(told)
                # of a label alone, and not of its tip; a style sheet costs more to set than all the numbers to compute
                if label.styleSheet() != style:
                    label.setStyleSheet(style)
        self._fit_notes()

    def _offer_fixes(self) -> None:
        """A button in each row that something would fix, beside its range."""
        offered = {one.key: one for one in self.fixes.found}
        for key, button in self._fix.items():
            button.setVisible(key in offered)
            if key in offered:
                button.setToolTip(f"<p>{sentence(offered[key])}. Ctrl+Z takes it back.</p>")

    def _apply(self, key: str, _checked: bool = False) -> None:
        for one in self.fixes.found:
            if one.key == key:
                self.fixes.apply(one)
                return

    def _add(self, key: str) -> tuple[ElidedLabel, QLabel | PlacingField, ElidedLabel]:
        """A line of labels at the end."""
        name, value, note = ElidedLabel(), self.placing.fields.get(key) or QLabel(), ElidedLabel()
        name.setMinimumWidth(LEAST_NAME)
        if isinstance(value, QLabel):
            value.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            value.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        # a narrow panel may shorten ranges and names, never the values; the tip has them whole
        note.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        row = len(self._labels)
        for column, label in enumerate((name, value)):
            self._grid.addWidget(label, 2 * row, column)
        for label in (name, value, note):
            label.show()
        button = QToolButton()
        button.setText("Fix")
        button.setObjectName("fix")
        button.clicked.connect(partial(self._apply, key))
        self._place(row, note, button, key in self._long)
        button.hide()
        self._fix[key] = button
        self._labels[key] = (name, value, note)
        return name, value, note

    def _place(self, row: int, note: QWidget, button: QWidget, long: bool) -> None:
        """Each read-out has two lines of the grid, the lower of which is for a range that has no room beside."""
        if self._narrow:
            first = 0 if long else 1
            self._grid.addWidget(note, 2 * row + 1, first, 1, 4 - first)
            self._grid.addWidget(button, 2 * row, 2, 1, 2, Qt.AlignmentFlag.AlignLeft)
        else:
            self._grid.addWidget(note, 2 * row, 2)
            self._grid.addWidget(button, 2 * row, 3)
