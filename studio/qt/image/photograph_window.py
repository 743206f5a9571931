"""Photographs of a real scanner's line in a window: what is found of it, beside the rendered image."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QKeyEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QScrollArea,
    QSplitter,
    QVBoxLayout,
    QWidget,
)

from analysis.line.result import CAUTIOUS
from render.base.threads import Cancel
from render.output.tone_mapping import Picture, pyramid
from studio.calibration.drawings import levels_of
from studio.calibration.image_views import SUFFIXES
from studio.photographs.laser_light import Channel
from studio.photographs.measured_set import MeasuredSet, measured_set
from studio.photographs.photograph_set import Wishes
from studio.qt.core import theme
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.drops import accept_copy, dragged_files
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.qt.core.widgets import ShareBar, breakable, text_button
from studio.qt.image.image_item import PictureView
from studio.qt.image.photograph_export import PhotographExport
from studio.qt.image.photograph_rectangle import PhotographRectangle
from studio.qt.image.zooms import Zooms
from studio.runtime.jobs import Job, Progress
from studio.scan.frame_views import picture, views

LANE, PICTURE, RENDERED = "photographs", "photograph", "rendered"
EMPTY = "Drop photographs of the line here, several of one set, or add them."
FILTER = "Images ({});;All files (*)"
CHOICES = {"colour": ("auto", "mono", "red", "green", "blue"), "axis": ("auto", "rows", "columns")}
AUTO = "auto"
NOT_YET = "Press Measure to find the line in {}."
OLD = "Settings have changed: these figures are of those before. Measure again for new ones."
NO_RENDER = "Nothing is rendered yet: Render (F5), and the image appears here"
NOT_CHOSEN = "No render is chosen: choose one in the list of the Render workspace"
NOT_DEVELOPED = "The render is being developed; its image appears here"
CONTROLS = 300
"""px of width."""


class PhotographWindow(QWidget):
    """A window that lives as long as its parent; `add` fills it."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setWindowTitle("Line in photographs")
        self.resize(1200, 720)
        self.setAcceptDrops(True)
        self.session, self.runner = session, JobRunner(self)
        self.paths: list[Path] = []
        self.offs: list[Path] = []
        self.found: MeasuredSet | None = None
        self._asked_for: tuple[list[Path], Wishes] | None = None
        """Of what is measured, or was last."""
        self._fitted = 0, 0
        """px, size of the photograph that was fitted into its view last."""
        self.names = QListWidget()
        self.colour, self.axis = ChoiceBox(), ChoiceBox()
        self.colour.addItems(CHOICES["colour"])
        self.axis.addItems(CHOICES["axis"])
        self.colour.setToolTip("Of the laser; auto: by the evidence of the whole set")
        self.axis.setToolTip("Scan lines that the line crosses; auto: by the evidence of the whole set")
        self.add_button = text_button("Add…", "Photographs of one set; or drop them")
        self.clear_button = text_button("Clear", "Start again with other photographs")
        self.off_button = text_button("Laser off…", "One for all photographs, or one each by name or order")
        self.off_told = QLabel("none")
        self.measure_button = text_button("Measure", "The line in all photographs of the set", "primary")
        self.export = PhotographExport(session, self.runner, lambda: self.found, self._shown)
        self.bar = ShareBar()
        self.old, self.told, self.chosen, self.problem = QLabel(OLD), QLabel(EMPTY), QLabel(), QLabel()
        self.written = QLabel()
        self.old.setObjectName("warning")
        for label in (self.old, self.told, self.chosen, self.problem, self.written):
            label.setWordWrap(True)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.problem.setObjectName("error")
        self.chosen.setObjectName("muted")
        self.view, self.rendered = PictureView(), PictureView()
        self.rectangle = PhotographRectangle(self.view)
        self.bright = QCheckBox("Brighten")
        self.bright.setToolTip("Square root of the light, to see what is faint; photographs come so")
        self.bright.setChecked(True)
        self.no_render = QLabel(NO_RENDER)
        self.no_render.setObjectName("muted")
        self.sure, self.doubtful = (pg.ScatterPlotItem(size=3, pen=None) for _ in range(2))
        for item in (self.sure, self.doubtful):
            item.setZValue(10)
            self.view.box.addItem(item, ignoreBounds=True)
        self._lay_out()
        self._connect()
        self._refresh()
        self._show_rendered()

    def add(self, paths: Sequence[Path]) -> None:
        """More photographs of the set; the first of them is shown."""
        new = [path for path in paths if path.suffix.lower() in SUFFIXES and path not in self.paths]
        if not new:
            return
        first = len(self.paths)
        self.paths += new
        self.names.addItems([path.name for path in new])
        self.names.setCurrentRow(first)
        self._refresh()

    def clear(self) -> None:
        """Without photographs, laser-off images and results."""
        self.runner.cancel(LANE)
        self.paths, self.offs, self.found, self._asked_for, self._fitted = [], [], None, None, (0, 0)
        self.names.clear()
        self.view.item.set_levels([])
        self.rectangle.clear()
        self._refresh()
        self._show_line()

    def set_offs(self, paths: Sequence[Path]) -> None:
        """Laser-off images: one for all, or one each."""
        self.offs = list(paths)
        self._refresh()

    def wishes(self) -> Wishes:
        """As the controls have it."""
        colour: Any = self.colour.currentText()
        axis: Any = self.axis.currentText()
        colour, axis = (None if value == AUTO else value for value in (colour, axis))
        channel: Channel | None = "mono" if colour == "mono" else None
        return Wishes(axis=axis, colour=colour, channel=channel, off=tuple(self.offs), region=self.rectangle.region())

    def measure(self) -> None:
        """The line in all photographs, on a thread."""
        if not self.paths:
            return
        self.problem.clear()
        self.written.clear()
        paths, wishes = list(self.paths), self.wishes()
        self._asked_for = paths, wishes
        self._show_age()

        def work(progress: Progress, cancelled: Cancel) -> MeasuredSet | None:
            def go_on(share: float) -> bool:
                progress("measuring", share)
                return not cancelled()

            return measured_set(paths, wishes, go_on)

        self.bar.setVisible(True)
        self.runner.run(LANE, "measuring photographs", work, self._take, interrupt=True)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        if any(path.suffix.lower() in SUFFIXES for path in dragged_files(event)):
            accept_copy(event)

    def dropEvent(self, event: QDropEvent) -> None:
        accept_copy(event)
        self.add(dragged_files(event))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Escape closes it, as it does a dialog."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            super().keyPressEvent(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        # the window may be opened again: the runner stays, what runs ends
        self.runner.cancel(LANE)
        super().closeEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "doubtful"):
            self._colour()
        super().changeEvent(event)

    def _colour(self) -> None:
        for view in (self.view, self.rendered):
            view.setBackground(theme.colours().base)

    def _lay_out(self) -> None:
        form = QFormLayout()
        form.addRow("Colour", self.colour)
        form.addRow("Scan axis", self.axis)
        off = QHBoxLayout()
        off.addWidget(self.off_button)
        off.addWidget(self.off_told, 1)
        form.addRow("Off image", off)
        buttons = QHBoxLayout()
        buttons.addWidget(self.add_button)
        buttons.addWidget(self.clear_button)
        left = QVBoxLayout()
        left.addLayout(buttons)
        left.addWidget(self.names, 1)
        left.addLayout(form)
        texts = QWidget()
        column = QVBoxLayout(texts)
        column.setContentsMargins(0, 0, 0, 0)
        for label in (self.problem, self.written, self.old, self.told, self.chosen):
            column.addWidget(label)
        column.addStretch(1)
        # texts of any length have room of their own, so that no control moves
        results = QScrollArea(widgetResizable=True)
        results.setFrameShape(QScrollArea.Shape.NoFrame)
        results.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        results.setWidget(texts)
        work = QHBoxLayout()
        work.addWidget(self.measure_button, 1)
        work.addWidget(self.export)
        left.addWidget(self.rectangle)
        left.addLayout(work)
        left.addWidget(self.bar)
        left.addWidget(results, 2)
        controls = QWidget()
        controls.setLayout(left)
        controls.setFixedWidth(CONTROLS)
        sides = QSplitter(Qt.Orientation.Horizontal)
        for title, view, more, note in (
            ("Photograph", self.view, None, None),
            ("Rendered", self.rendered, self.bright, self.no_render),
        ):
            side, column, head = QWidget(), QVBoxLayout(), QHBoxLayout()
            column.setContentsMargins(0, 0, 0, 0)
            head.addWidget(QLabel(title))
            head.addStretch(1)
            if more is not None:
                head.addWidget(more)
            head.addWidget(Zooms(view))
            column.addLayout(head)
            column.addWidget(view, 1)
            if note is not None:
                column.addWidget(note)
            side.setLayout(column)
            sides.addWidget(side)
        layout = QHBoxLayout(self)
        layout.addWidget(controls)
        layout.addWidget(sides, 1)
        room = self.bar.sizePolicy()
        room.setRetainSizeWhenHidden(True)
        self.bar.setSizePolicy(room)
        self.bar.setVisible(False)

    def _connect(self) -> None:
        self.add_button.clicked.connect(self._ask)
        self.clear_button.clicked.connect(self.clear)
        self.off_button.clicked.connect(self._ask_off)
        self.measure_button.clicked.connect(self.measure)
        self.export.told.connect(lambda text: self.written.setText(breakable(text)))
        for signal in (self.colour.currentIndexChanged, self.axis.currentIndexChanged, self.rectangle.changed):
            signal.connect(lambda *_: self._show_age())
        self.bright.toggled.connect(lambda on: self._show_rendered())
        self.names.currentRowChanged.connect(lambda row: self._show())
        self.runner.failed.connect(self._failed)
        self.runner.progress.connect(lambda job: self.bar.show_share(job.done))
        self.session.renders_changed.connect(self._show_rendered)
        self.session.developed.connect(self._show_rendered)
        self._colour()
        self.sure.setBrush(pg.mkBrush("#00e600"))
        self.doubtful.setBrush(pg.mkBrush("#ffb400"))

    def _ask(self) -> None:
        self.add(self._asked("Photographs of the line"))

    def _ask_off(self) -> None:
        self.set_offs(self._asked("Images with the laser off"))

    def _asked(self, title: str) -> list[Path]:
        kinds = " ".join(f"*{suffix}" for suffix in sorted(SUFFIXES))
        folder = str(self.paths[-1].parent) if self.paths else ""
        return [Path(name) for name in QFileDialog.getOpenFileNames(self, title, folder, FILTER.format(kinds))[0]]

    def _show_age(self) -> None:
        """Whether the figures are of what is set."""
        self.old.setVisible(self.found is not None and self._asked_for != (self.paths, self.wishes()))

    def _refresh(self) -> None:
        self.measure_button.setEnabled(bool(self.paths))
        self.off_told.setText(", ".join(path.name for path in self.offs) or "none")
        if not self.paths:
            self.told.setText(EMPTY)
            for label in (self.chosen, self.problem, self.written):
                label.clear()
        elif self.found is None:
            count = len(self.paths)
            self.told.setText(NOT_YET.format("this photograph" if count == 1 else f"these {count} photographs"))
        self._show_age()

    def _shown(self) -> Path | None:
        row = self.names.currentRow()
        return self.paths[row] if 0 <= row < len(self.paths) else None

    def _show(self) -> None:
        path = self._shown()
        if path is None:
            return

        def then(levels: list[Picture]) -> None:
            if self._shown() != path:
                return
            self.view.item.set_levels(levels)
            self.rectangle.follow_picture()
            if self._fitted != self.view.item.size:
                self._fitted = self.view.item.size
                self.view.fit()

        self.runner.run(PICTURE, "reading", lambda progress, cancelled: levels_of(path), then, interrupt=True)
        self._show_line()
        self._show_rendered()

    def _take(self, found: MeasuredSet | None) -> None:
        self.bar.setVisible(False)
        if found is not None:
            self.found = found
            self._show_line()
            self._show_age()

    def _failed(self, job: Job[object]) -> None:
        self.bar.setVisible(False)
        self.problem.setText(job.problem.text if job.problem is not None else "")

    def _show_line(self) -> None:
        self.export.refresh()
        path, empty = self._shown(), np.zeros(0)
        measured = None if self.found is None or path is None else self.found.lines.get(path)
        for item in (self.sure, self.doubtful):
            item.setData(empty, empty)
        if self.found is None or path is None:
            return
        self.told.setText(self.found.told_of(path))
        self.chosen.setText("\n".join(self.found.chosen))
        if measured is None:
            return
        pixels, index, rank = measured.line.pixels()
        doubtful = np.isin(measured.line.flag[index, rank], CAUTIOUS)
        self.sure.setData(pixels[~doubtful, 0], pixels[~doubtful, 1])
        self.doubtful.setData(pixels[doubtful, 0], pixels[doubtful, 1])

    def _show_rendered(self) -> None:
        shown = self.session.shown
        there = shown is not None and bool(shown.images)
        self.no_render.setVisible(not there)
        self.no_render.setText(
            NO_RENDER if not self.session.renders else NOT_CHOSEN if shown is None else NOT_DEVELOPED
        )
        if shown is None or not there:
            return
        scene, frame, images = shown.project.scene, shown.frame, list(shown.images)
        bright = self.bright.isChecked()

        def work(progress: Progress, cancelled: Cancel) -> list[Picture]:
            made = picture(views(scene, frame)[0], scene, frame, images, bright)
            return [] if made is None else pyramid(made)

        def then(levels: list[Picture]) -> None:
            before = self.rendered.item.size
            self.rendered.item.set_levels(levels)
            if self.rendered.item.size != before:
                self.rendered.fit()

        self.runner.run(RENDERED, "drawing", work, then, interrupt=True)
