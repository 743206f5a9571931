"""A picture of the contact sheet in a window of its own, as large as the recipe makes it, with its exact line."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import QCheckBox, QDialog, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from render.base.errors import InputError
from render.base.threads import Cancel
from render.output.tone_mapping import pyramid
from studio.dataset.contact_sheet import LINE, Picture, large_picture
from studio.dataset.written import written_picture
from studio.qt.core import theme
from studio.qt.core.jobs import JobRunner
from studio.qt.dataset.dataset_work import DatasetWork
from studio.qt.image.image_item import PictureView
from studio.qt.image.zooms import Zooms
from studio.runtime.jobs import Job, Progress

LANE = "large picture"
FRAME = 80
"""px that a window's title and edges take of the screen."""
SMALL = "Small, as on the sheet; it is being made in its own size."


class LargePicture(QDialog):
    """What is on the sheet is shown at once, and replaced when the picture is there in its own size."""

    def __init__(self, work: DatasetWork, picture: Picture, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Window)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        what = "Image" if work.shows_written else "Scene"
        self.setWindowTitle(f"{what} {picture.number} of {work.name}")
        room = self.screen().availableGeometry()
        self.resize(min(900, room.width() - FRAME), min(700, room.height() - FRAME))
        self.move(room.center() - self.rect().center())  # over the sheet its title would be off the screen
        self.runner = JobRunner(self)
        self.view = PictureView()
        self.view.setBackground(theme.colours().base)
        self.line = pg.ScatterPlotItem(size=2, pen=None, brush=pg.mkBrush(LINE))
        self.line.setZValue(10)
        self.view.box.addItem(self.line, ignoreBounds=True)
        self.with_line = QCheckBox("Exact line")
        self.with_line.setChecked(True)
        self.told = QLabel(SMALL)
        self.told.setObjectName("muted")
        head = QHBoxLayout()
        head.addWidget(self.with_line)
        head.addWidget(self.told, 1)
        head.addWidget(Zooms(self.view))
        layout = QVBoxLayout(self)
        layout.addLayout(head)
        layout.addWidget(self.view, 1)
        self.with_line.toggled.connect(self.line.setVisible)
        self.runner.failed.connect(self._failed)
        self.put(picture)
        self._enlarge(work, picture)

    def put(self, picture: Picture) -> None:
        """Another picture of the same."""
        grey = np.asarray(255.0 * np.clip(picture.values, 0.0, 1.0), np.uint8)
        self.view.item.set_levels(pyramid(np.ascontiguousarray(np.repeat(grey[..., None], 4, axis=2))))
        pairs = [
            (one.position, one.index) if one.axis == "rows" else (one.index, one.position) for one in picture.curves
        ]
        x, y = (np.concatenate([pair[k] for pair in pairs] or [np.zeros(0)]) for k in (0, 1))
        there = np.isfinite(x) & np.isfinite(y)
        self.line.setData(x[there], y[there])
        self.view.fit()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.runner.close()
        super().closeEvent(event)

    def _enlarge(self, work: DatasetWork, picture: Picture) -> None:
        recipe, root, folder, number = work.recipe, work.root, work.folder, picture.number
        written = work.shows_written and folder is not None

        def make(progress: Progress, cancelled: Cancel) -> Picture:
            if written:
                assert folder is not None
                return written_picture(folder, number, side=None)
            return large_picture(recipe, root, number, cancelled)

        def then(large: Picture) -> None:
            height, width = large.values.shape
            how = "as written" if written else "rendered as a run renders it"
            self.told.setText(f"{width} x {height} px, {how}; dark parts are brightened")
            self.put(large)

        self.runner.run(LANE, "large picture", make, then)

    def _failed(self, job: Job[object]) -> None:
        problem = job.problem
        known = problem is not None and isinstance(problem.exception, InputError)
        self.told.setText(problem.text if known and problem is not None else "It cannot be made in its own size.")
