"""What is calibrated, from which photographs or virtual boards, and what is done with the result."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QSignalBlocker, Qt
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.editing.units import Unit
from studio.project.calibration import Calibration
from studio.qt.calibrate.calibration_work import BOARD, CalibrationWork
from studio.qt.calibrate.keeping import ask_and_save, use, use_file
from studio.qt.calibrate.view_table import ViewTable
from studio.qt.core.boxes import ChoiceBox
from studio.qt.core.jobs import JobRunner, time_left
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import ElidedLabel, ShareBar, breakable, text_button
from studio.qt.forms.unit_box import UnitBox
from studio.runtime.jobs import Job, State

EMPTY = (
    "Drop photographs of a board here, or their folder. Pairs are put together by name: a_off.png and a_on.png, or "
    "a_laser0.png, a_laser1.png; a plain a.png shows board and line in one. In silico takes virtual boards before the "
    "open project's camera."
)
PARTS = (
    ("Camera and lasers", "scanner"),
    ("Camera alone", "camera"),
    ("Lasers, camera known…", "laser"),
    ("Whether one still holds…", "check"),
)
OF_A_FILE = {
    "laser": ("Calibration file of the camera", "Lasers, {}"),
    "check": ("Calibration file to check", "Whether {} still holds"),
}
"""What a person is asked for, and what is shown of the answer."""
LENSES = (("By held-out views", None), *((f"{terms} distortion terms", terms) for terms in (0, 4, 5, 8, 12, 14)))
CARRIED = (("Board put by hand", None), ("Carried by…", "camera"), ("Carried by a robot's hand…", "board"))
OF_PROJECT = "Carried as the project moves"
"""In place of the first, of virtual boards."""
TABLES = "Tables (*.csv);;All files (*)"
FILES = "Calibrations (*.json);;All files (*)"
NARROWEST = 250
"""px."""


class CalibratePanel(QWidget):
    """What a person does about a calibration; picture and result have panels of their own."""

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setMinimumWidth(NARROWEST)
        self.session, self.runner, self.work = session, runner, one_of(CalibrationWork, session)
        self.work.attach(runner)
        self.photographs = text_button("Photographs…", "A folder of photographs of a board; or drop it here")
        self.simulate = text_button(
            "In silico", "Virtual boards about where the lines lie on the parts, beside the truth"
        )
        self.source = ElidedLabel(Qt.TextElideMode.ElideMiddle)
        self.source.setObjectName("muted")
        self.source.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.board = QLineEdit(BOARD, maxLength=100)
        self.board.setToolTip(
            "<p>Kind, counts and side: checkerboard:13x9:25mm counts the corners where four squares meet; "
            "charuco:14x10:25mm:18mm counts squares and has markers of 18 mm</p>"
        )
        self.what, self.lens, self.carried = ChoiceBox(), ChoiceBox(), ChoiceBox()
        for text, part in PARTS:
            self.what.addItem(text, part)
        for text, terms in LENSES:
            self.lens.addItem(text, terms)
        self.what.setToolTip(
            "<p>What is found; lasers alone need the calibration file of a camera, and one to three new photographs "
            "tell whether a calibration file still holds</p>"
        )
        self.lens.setToolTip(
            "How many terms the lens has; by held-out views: the fewest that none with more is proved better than"
        )
        for text, holds in CARRIED:
            self.carried.addItem(text, holds)
        self.carried.setToolTip(
            "<p>A table of what a stage, a turntable or a robot whose hand holds the camera was told at each "
            "photograph, or a robot whose hand holds the board; virtual boards follow the project's own motion</p>"
        )
        for box in (self.what, self.lens, self.carried):
            box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.target = UnitBox(Unit.named("µm"), 0.0, 1e6, 1, singleStep=5.0)
        self.target.setSpecialValueText("as little as possible")
        self.target.setToolTip("Depth error that is enough: no next pose is asked for below it")
        self.target.setAccessibleName("Depth error that is enough")
        self.nearest, self.farthest = (UnitBox(Unit.named("mm"), 0.0, 1e5, 0, singleStep=10.0) for _ in range(2))
        for side in (self.nearest, self.farthest):
            side.setSpecialValueText("nearest board" if side is self.nearest else "farthest board")
            side.setToolTip("Between which distances depth is measured: as far as the boards are, or as is typed")
            side.setAccessibleName("Distance")
            side.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.views = ViewTable(self.work)
        self.empty = QLabel(EMPTY, wordWrap=True)
        self.empty.setObjectName("muted")
        self.empty.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.problem = QLabel(wordWrap=True)
        self.problem.setObjectName("error")
        self.problem.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.bar = ShareBar()
        self.stage = QLabel()
        self.stage.setObjectName("muted")
        self.stop = text_button("Stop", "What was found before stays")
        self.save = text_button(
            "Save…", "The calibration file, for projects and later calibrations; or the camera for others"
        )
        self.use = text_button("Use in project", "Points of the open project are made with what was found", "primary")
        self.project = QLabel()
        self.project.setObjectName("muted")
        self._lay_out()
        self._connect()
        self.refresh()

    def closeEvent(self, event: QCloseEvent) -> None:
        self.work.close()
        super().closeEvent(event)

    def refresh(self) -> None:
        """Follow what is there, what is asked for and what runs."""
        work, there = self.work, self.work.material is not None
        self.source.setText(work.source or "nothing yet")
        self.views.setVisible(there)
        self.empty.setVisible(not there)
        self.problem.setText(breakable(work.problem))
        self.problem.setVisible(bool(work.problem))
        for widget in (self.bar, self.stage, self.stop):
            widget.setVisible(work.running)
        if not work.running:
            self.bar.show_none()
            self.stage.clear()
        self.save.setEnabled(work.solved is not None)
        self.use.setEnabled(work.solved is not None)
        if not self.board.hasFocus():
            self.board.setText(work.board_text)
            self.board.setCursorPosition(0)
        self.lens.setEnabled(work.what not in OF_A_FILE)  # the known camera has its own
        table, holds = work.motion_file, None if work.motion_file is None else work.holds
        for i, (text, which) in enumerate(CARRIED):
            self.carried.setItemText(i, text if table is None or which != holds else f"{text[:-1]}: {table.name}")
        with QSignalBlocker(self.carried):
            self.carried.setCurrentIndex(next(i for i, (_, which) in enumerate(CARRIED) if which == holds))
        moved = work.virtual and work.material is not None and work.material.told is not None
        self.carried.setItemText(0, OF_PROJECT if moved else CARRIED[0][0])
        self.carried.setEnabled(not work.virtual)
        for i, (text, part) in enumerate(PARTS):
            named = work.camera_file if part == work.what and part in OF_A_FILE else None
            self.what.setItemText(i, text if named is None else OF_A_FILE[part][1].format(named.name))
        with QSignalBlocker(self.what):
            self.what.setCurrentIndex(next(i for i, (_, part) in enumerate(PARTS) if part == work.what))

    def _tell_project(self) -> None:
        calibrated = self.session.project.calibration != Calibration()
        self.project.setText("The project has a calibration" if calibrated else "The project has no calibration")

    def ask_folder(self) -> None:
        """For the folder of photographs."""
        chosen = QFileDialog.getExistingDirectory(self, "Folder of the photographs", self._place())
        if chosen:
            self.work.open_folder(Path(chosen))

    def ask_and_save(self) -> None:
        """For the calibration file."""
        ask_and_save(self.work, self)

    def ask_and_use(self) -> None:
        """For a calibration file that the project is to be measured with."""
        chosen = self._calibration_file("Use a calibration in the project")
        if chosen is not None:
            use_file(self.work, chosen)

    def _calibration_file(self, title: str) -> Path | None:
        chosen, _ = QFileDialog.getOpenFileName(self, title, self._place(), FILES)
        return Path(chosen) if chosen else None

    def _place(self) -> str:
        return self.work.source if self.work.shots else str(self.session.place)

    def _choose_what(self, index: int) -> None:
        part = self.what.itemData(index)
        if part in OF_A_FILE:
            file = self._calibration_file(OF_A_FILE[part][0])
            if file is None:
                self.refresh()
                return
            self.work.choose_what(part, file)
        else:
            self.work.choose_what(part)

    def _choose_carried(self, index: int) -> None:
        holds = self.carried.itemData(index)
        if holds is None:
            self.work.choose_motion(None)
            self.refresh()
            return
        chosen, _ = QFileDialog.getOpenFileName(self, "Table of the motion", self._place(), TABLES)
        if chosen:
            self.work.choose_motion(Path(chosen), holds)
        self.refresh()

    def _choose_range(self) -> None:
        nearest, farthest = (1e-3 * side.value() or None for side in (self.nearest, self.farthest))
        self.work.choose_range(nearest, farthest)

    def _tell_progress(self, job: Job[object]) -> None:
        if job is self.work.job:
            self.bar.show_share(job.done)
            left = "paused" if job.state is State.PAUSED else time_left(job.seconds_left)
            self.stage.setText("stopping" if job.cancel_asked else f"{job.stage or job.name}   {left}")

    def _connect(self) -> None:
        work = self.work
        self.photographs.clicked.connect(self.ask_folder)
        self.simulate.clicked.connect(work.simulate)
        self.board.editingFinished.connect(lambda: work.choose_board(self.board.text()))
        self.what.activated.connect(self._choose_what)
        self.lens.activated.connect(lambda index: work.choose_terms(self.lens.itemData(index)))
        self.carried.activated.connect(self._choose_carried)
        self.target.valueChanged.connect(lambda value: work.choose_target(value or None))
        for side in (self.nearest, self.farthest):
            side.valueChanged.connect(self._choose_range)
        for box in (self.target, self.nearest, self.farthest):
            box.refused.connect(partial(self.session.message.emit, "warning"))
        self.stop.clicked.connect(work.stop)
        self.save.clicked.connect(self.ask_and_save)
        self.use.clicked.connect(lambda: use(work))
        for changed in (work.state_changed, work.material_changed, work.solved_changed):
            changed.connect(self.refresh)
        self.runner.progress.connect(self._tell_progress)
        self.session.project_changed.connect(self._tell_project)
        self._tell_project()

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 8)
        column.setSpacing(6)
        sources = QHBoxLayout()
        sources.addWidget(self.photographs)
        sources.addWidget(self.simulate)
        sources.addStretch(1)
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.setVerticalSpacing(3)  # a low screen holds seven rows and the table
        form.addRow("Board", self.board)
        form.addRow("Find", self.what)
        form.addRow("Lens", self.lens)
        form.addRow("Motion", self.carried)
        form.addRow("Depth from", self.nearest)
        form.addRow("Depth to", self.farthest)
        form.addRow("Error wanted", self.target)
        running = QHBoxLayout()
        running.addWidget(self.stage, 1)
        running.addWidget(self.stop)
        buttons = QHBoxLayout()
        for button in (self.use, self.save):
            buttons.addWidget(button)
        buttons.addStretch(1)
        column.addLayout(sources)
        column.addWidget(self.source)
        column.addLayout(form)
        column.addWidget(self.empty, 1)
        column.addWidget(self.views, 1)
        for widget in (self.problem, self.bar):
            column.addWidget(widget)
        column.addLayout(running)
        column.addWidget(self.project)
        column.addLayout(buttons)
