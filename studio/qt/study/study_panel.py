"""The study that is put together: its question, what it takes, and run, stop, go on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QMenu,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from studio.qt.core.boxes import ChoiceBox, DecimalBox, WholeBox
from studio.qt.core.dialogs import choose_file
from studio.qt.core.folders import ask_results_folder
from studio.qt.core.icons import icon_button
from studio.qt.core.jobs import JobRunner, duration
from studio.qt.core.run_foot import RunFoot
from studio.qt.core.session import Session, one_of
from studio.qt.core.tab_order import tab_as_laid_out
from studio.qt.core.widgets import Scrolled, align_labels, flush, text_button
from studio.qt.study.keeping_study import FILES, ask_and_save, may_be_replaced
from studio.qt.study.study_work import StudyWork
from studio.qt.study.sweep_editor import SweepEditor
from studio.runtime.jobs import Job
from studio.study.draft import new_sweep, varies_nothing
from studio.study.estimate import Estimate
from studio.study.study import Study, ready_made

NOT_OPEN = "its own, not the open project"
EMPTY = "What it takes is told here as soon as every sweep varies a field."


class StudyPanel(QWidget):
    """What a person does about a study; the charts have a panel of their own."""

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self.work = one_of(StudyWork, session)
        self.work.attach(runner)
        self.name = QLineEdit(maxLength=100)
        self.name.setAccessibleName("Name of the study")
        self.files = text_button("File", "Ready-made studies, files, and results of earlier runs")
        menu = QMenu(self.files)
        menu.aboutToShow.connect(partial(self._fill_files, menu))
        self.files.setMenu(menu)
        self.base = ChoiceBox()
        self.base.setToolTip("The project that every cell is a variation of")
        self.not_open = QLabel(NOT_OPEN)
        self.not_open.setObjectName("muted")
        self.laser = ChoiceBox()
        self.laser.setToolTip("The laser whose line every cell measures")
        self.sweeps = ChoiceBox()
        self.sweeps.setToolTip("A study has one chart for each sweep; type to give this one another name")
        self.sweeps.setEditable(True)
        self.sweeps.setInsertPolicy(ChoiceBox.InsertPolicy.NoInsert)
        for box in (self.base, self.sweeps):
            box.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.add_sweep = icon_button("new", "Another sweep", self._add_sweep)
        self.remove_sweep = icon_button("cancel", "Remove this sweep", self._remove_sweep)
        self.editor = SweepEditor(self.work)
        self.repeats = WholeBox(minimum=1, maximum=10_000)
        self.repeats.setToolTip("Of every cell, each with a seed of its own: intervals come from them")
        self.scale = DecimalBox(minimum=0.01, maximum=4.0, decimals=3, singleStep=0.05)
        self.scale.setToolTip("So many times the pixels a side; figures are the scanner's at 1 alone")
        self.repeats.setKeyboardTracking(False)
        self.scale.setKeyboardTracking(False)
        self.told = QLabel(wordWrap=True)
        self.time = text_button("Time it", "Measure one cell of each sweep, to tell how long the study takes")
        self.problem = QLabel(wordWrap=True)
        self.problem.setObjectName("error")
        for label in (self.told, self.problem):
            label.setMinimumWidth(1)  # the path of a folder is one long word
        self.problem.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        folder_tip = "Where the results go; a study that is there goes on"
        self.foot = RunFoot(folder_tip, "What is measured stays", [self.time])
        self._lay_out()
        self._connect()
        self.refresh()
        self._show_state()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self.work.look()

    def hideEvent(self, event: QHideEvent) -> None:
        self.work.watched = False
        super().hideEvent(event)

    def refresh(self) -> None:
        """Follow the draft."""
        work, draft = self.work, self.work.draft
        if not self.name.hasFocus():
            self.name.setText(draft["name"])
        for box in (self.base, self.laser, self.sweeps, self.repeats, self.scale):
            box.blockSignals(True)
        self.base.clear()
        self.base.addItem(self._open_project())
        if draft["base"] in work.loaded:
            self.base.addItem(f"{draft['base'].replace('_', ' ')}, as in the study")
            self.base.setCurrentIndex(1)
        self.not_open.setVisible(draft["base"] in work.loaded)
        self._show_lasers()
        self.sweeps.clear()
        self.sweeps.addItems([sweep["name"] for sweep in draft["sweeps"]])
        self.sweeps.setCurrentIndex(work.chosen)
        self.repeats.setValue(draft.get("repeats", Study.model_fields["repeats"].default))
        self.scale.setValue(draft.get("image_scale", 1.0))
        for box in (self.base, self.laser, self.sweeps, self.repeats, self.scale):
            box.blockSignals(False)
        self.remove_sweep.setEnabled(len(draft["sweeps"]) > 1)

    def _show_lasers(self) -> None:
        names, chosen = [laser.name for laser in self.work.project().scene.lasers], self.work.draft.get("laser", 0)
        if names != [self.laser.itemText(i) for i in range(self.laser.count())]:
            self.laser.clear()
            self.laser.addItems(names)
        self.laser.setCurrentIndex(chosen if chosen < len(names) else -1)
        self.laser.setVisible(len(names) > 1 or chosen >= len(names))

    def _open_project(self) -> str:
        return f"Open: {self.session.project.name}"

    def ask_and_run(self) -> None:
        """Ask for a folder where there is none yet, then run, go on or extend."""
        if self.work.folder is None and not self.ask_folder():
            return
        self.work.start()

    def ask_folder(self) -> bool:
        """False: none was chosen."""
        name = f"{self.work.draft['name']} results"
        chosen = ask_results_folder(self, "Folder for the study's results", self.session.place, name)
        if chosen is not None:
            self.session.chose(chosen)
            self.work.choose_folder(chosen)
        return chosen is not None

    def _fill_files(self, menu: QMenu) -> None:
        menu.clear()
        menu.addAction("New study", partial(self._replace, self.work.start_anew))
        ready = menu.addMenu("Ready-made")
        for name in ready_made():
            ready.addAction(name.replace("_", " ").capitalize(), partial(self._replace, self.work.load, name))
        menu.addAction("Open a study's file…", self._open)
        menu.addAction("Open results…", self._open_results)
        menu.addSeparator()
        menu.addAction("Save the study…", self._save)

    def _replace(self, come: Callable[..., None], *which: Path | str) -> None:
        """Another study in place of this one, unless a person stays with this one."""
        if may_be_replaced(self.work, self):
            come(*which)

    def _open(self) -> None:
        chosen = choose_file(self.session, self, "Open a study", FILES)
        if chosen is not None:
            self._replace(self.work.load, chosen)

    def _open_results(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Folder of a study's results", str(self.session.place))
        if chosen:
            self.session.chose(Path(chosen))
            self._replace(self.work.open_folder, Path(chosen))

    def _save(self) -> None:
        ask_and_save(self.work, self)

    def _add_sweep(self) -> None:
        work = self.work
        names = {sweep["name"] for sweep in work.draft["sweeps"]}
        number = next(i for i in range(1, len(names) + 2) if f"Sweep {i}" not in names)
        work.change(lambda draft: draft["sweeps"].append(new_sweep(f"Sweep {number}")))
        work.choose_sweep(len(work.draft["sweeps"]) - 1)

    def _remove_sweep(self) -> None:
        chosen = self.work.chosen
        if len(self.work.draft["sweeps"]) > 1:
            self.work.change(lambda draft: draft["sweeps"].pop(chosen))

    def _rename_sweep(self) -> None:
        text = self.sweeps.currentText().strip()
        if text and text != self.work.sweep["name"]:
            self.work.change_sweep(name=text)

    def _rename(self) -> None:
        self.work.change(lambda draft: draft.update(name=self.name.text().strip() or "study"))

    def _connect(self) -> None:
        work = self.work
        self.name.editingFinished.connect(self._rename)
        self.base.activated.connect(lambda i: work.use_open_project() if i == 0 else None)
        self.laser.activated.connect(lambda i: work.change(lambda draft: draft.update(laser=i)))
        self.sweeps.activated.connect(work.choose_sweep)
        line = self.sweeps.lineEdit()
        if line is not None:
            line.editingFinished.connect(self._rename_sweep)
        self.repeats.valueChanged.connect(lambda count: work.change(lambda draft: draft.update(repeats=count)))
        self.scale.valueChanged.connect(lambda scale: work.change(lambda draft: draft.update(image_scale=scale)))
        self.time.clicked.connect(lambda: work.look_ahead(timed=True))
        self.foot.choose.clicked.connect(lambda: self.ask_folder())
        self.foot.run.clicked.connect(self.ask_and_run)
        self.foot.stop.clicked.connect(work.stop)
        self.editor.rows_made.connect(self._order_tabs)
        work.draft_changed.connect(self.refresh)
        work.estimated.connect(self._tell_estimate)
        for changed in (work.state_changed, work.found_changed):
            changed.connect(self._show_state)
        work.unseen.progress.connect(self._tell_timing)
        self.runner.progress.connect(self._tell_progress)
        self.session.document_replaced.connect(self.refresh)
        self.session.project_changed.connect(self._follow_project)

    def _follow_project(self) -> None:
        self.base.setItemText(0, self._open_project())
        self._show_lasers()

    def _tell_estimate(self) -> None:
        work, empty = self.work, varies_nothing(self.work.draft)
        self.problem.setText("\n".join(dict.fromkeys(filter(None, (work.problem, work.failure)))))
        self.problem.setVisible(bool(self.problem.text()))
        if work.estimate is not None:
            self.told.setText(estimate_text(work.estimate, work.processors))
        else:
            self.told.setText("" if work.problem else EMPTY if empty else "Working out what it takes…")
        self.told.setObjectName("muted" if empty else "")
        self.told.style().polish(self.told)
        self._show_state()

    def _tell_timing(self, job: Job[object]) -> None:
        if job.stage:
            self.told.setText(job.stage)

    def _tell_progress(self, job: Job[object]) -> None:
        if job is self.work.job:
            self.foot.tell_progress(job, self.work.promised)

    def _show_state(self) -> None:
        work = self.work
        there = len(work.found.rows) if work.found is not None else 0
        left = work.estimate is None or work.estimate.cells + work.estimate.searched > 0
        # what was worked out before a run is not what is left of it, which the foot tells
        self.told.setVisible(bool(self.told.text()) and not work.running)
        self.time.setVisible(work.estimate is not None and work.estimate.seconds is None and not work.running)
        self.foot.show_state(work.folder, work.job, begun=there > 0 and left)
        self.foot.run.setEnabled(work.estimate is not None and left)
        self.foot.run.setToolTip(f"{there} cells are there; what is missing is measured" if there else "")

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        head.addWidget(self.name, 1)
        head.addWidget(self.files)
        sweeps = QHBoxLayout()
        sweeps.setSpacing(2)
        sweeps.addWidget(self.sweeps, 1)
        sweeps.addWidget(self.add_sweep)
        sweeps.addWidget(self.remove_sweep)
        form = QFormLayout()
        form.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        form.addRow("Study", head)
        of = QHBoxLayout()
        of.addWidget(self.base, 1)
        of.addWidget(self.laser)
        form.addRow("Of", of)
        form.addRow("", self.not_open)
        form.addRow("Sweep", sweeps)
        runs = QHBoxLayout()
        runs.addWidget(self.repeats)
        runs.addWidget(QLabel("at scale"))
        runs.addWidget(self.scale)
        runs.addStretch(1)
        last = QFormLayout()
        last.addRow("Repeats", runs)
        align_labels(form, self.editor.form, last)
        inside = QWidget()
        column = QVBoxLayout(inside)
        column.setContentsMargins(8, 8, 8, 4)
        column.addLayout(form)
        column.addWidget(self.editor)
        column.addLayout(last)
        column.addStretch(1)
        self.inside = inside
        foot = QVBoxLayout()
        foot.setContentsMargins(8, 4, 8, 8)
        foot.setSpacing(4)
        for widget in (self.told, self.problem, self.foot):
            foot.addWidget(widget)
        layout = flush(QVBoxLayout(self))
        layout.addWidget(Scrolled(inside), 1)
        layout.addLayout(foot)
        self._order_tabs()

    def _order_tabs(self) -> None:
        tab_as_laid_out(self)


def estimate_text(told: Estimate, processors: int) -> str:
    """ "40 cells of 10 renders to go, about 2:10 on 2 processors, 0.3 MB", and what to know of figures at its scale.

    A cell of one study takes a hundred times what one of another does: before one was measured no time is told.
    """
    notes = [left_over_text(told.left_over), *told.doubts] if told.left_over else told.doubts
    if told.cells + told.searched == 0:
        return " ".join(["Every cell is measured.", *notes])
    parts = [f"{told.cells} cells of {told.renders} renders to go"]
    if told.steps > 1:
        parts.append(f"step 1 of {told.steps} alone")
    if told.searched:
        parts.append(f"up to {told.searched} more that the search asks for")
    if (seconds := told.wall(processors)) is not None:
        start = f" ({duration(told.start_up)} of it until they start)" if told.start_up >= 1.0 else ""
        parts.append(f"about {duration(seconds)} on {processors} processors{start}")
    else:
        parts.append("not timed yet (Time it measures one cell of each sweep)")
    parts.append(f"{told.bytes / 1e6:.1f} MB")
    return "\n".join([", ".join(parts), *notes])


def left_over_text(cells: int) -> str:
    if cells == 1:
        return "1 measured cell is of values that are no longer asked for (it stays in the folder)."
    return f"{cells} measured cells are of values that are no longer asked for (they stay in the folder)."
