"""The recipe of a dataset: what is drawn and from where, how many images, and run, stop, go on."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QFileDialog,
    QFormLayout,
    QHBoxLayout,
    QLabel,
    QMenu,
    QVBoxLayout,
    QWidget,
)

from studio.dataset.field_names import field_name
from studio.dataset.images import images_of
from studio.dataset.recipe import MOST_VARIANTS, ready_made
from studio.editing.forms import PLAIN
from studio.project.templates import DESCRIPTIONS
from studio.qt.core.boxes import WholeBox
from studio.qt.core.folders import ask_results_folder
from studio.qt.core.jobs import JobRunner
from studio.qt.core.run_foot import RunFoot
from studio.qt.core.session import Session, one_of
from studio.qt.core.widgets import ElidedLabel, Scrolled, flush, text_button
from studio.qt.dataset.dataset_work import DatasetWork
from studio.qt.dataset.draw_row import DrawRow
from studio.qt.scene.field_menu import fill_field_menu
from studio.runtime.jobs import Job

ALL_THERE = "; a higher number of scenes makes more"
NOTHING_DRAWN = "Nothing is drawn yet, and all scenes are alike: add what is to be drawn of the project."
SIZE_TIP = (
    "Of the project's own width and height; exposures are shortened as pixels get larger, so that images stay as bright"
)
FILES = "Recipes (*.json);;All files (*)"


class RecipePanel(QWidget):
    """What a person does about a dataset; its pictures have a panel of their own."""

    def __init__(self, session: Session, runner: JobRunner, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session, self.runner = session, runner
        self.work = one_of(DatasetWork, session)
        self.work.attach(runner)
        self.name = ElidedLabel()
        self.files = text_button("Recipe", "Ready-made recipes and files")
        menu = QMenu(self.files)
        menu.aboutToShow.connect(partial(self._fill_files, menu))
        self.files.setMenu(menu)
        self.about = QLabel(wordWrap=True)
        self.about.setObjectName("muted")
        self.rows: list[DrawRow] = []
        self.add = text_button("Draw a field", "Every field of the recipe's project")
        fields = QMenu(self.add)
        fields.aboutToShow.connect(partial(self._fill_fields, fields))
        self.add.setMenu(fields)
        self.scenes = WholeBox(minimum=1, maximum=10_000_000, value=self.work.scenes)
        self.scenes.setToolTip("Each is rendered once")
        self.images = WholeBox(minimum=1, maximum=MOST_VARIANTS)
        self.images.setToolTip("Photographs of each scene: they share its light and draw the sensor anew")
        self.image_size = WholeBox(minimum=1, maximum=400, suffix=" %")
        self.image_size.setToolTip(SIZE_TIP)
        self.seed = WholeBox(minimum=0, maximum=2**31 - 1)
        self.seed.setToolTip("Decides every scene and every image")
        self.told = QLabel(wordWrap=True)
        self.foot = RunFoot("Where the images go; a dataset that is there goes on", "What is made stays")
        self._lay_out()
        self._connect()
        self.refresh()
        self._show_state()

    def refresh(self) -> None:
        """Follow the recipe."""
        recipe = self.work.recipe
        self.name.setText(recipe.name)
        self.about.setText(recipe.about or ("" if recipe.draw else NOTHING_DRAWN))
        size = round(100.0 * recipe.image_scale)
        for box, value in ((self.images, recipe.images), (self.image_size, size), (self.seed, recipe.seed)):
            box.blockSignals(True)
            box.setValue(min(value, box.maximum()))
            box.blockSignals(False)
        fields = [(one.field, one.kind) for one in recipe.draw]
        if [(row.draw.field, row.draw.kind) for row in self.rows] != fields:
            self._make_rows()
            return
        for row, draw in zip(self.rows, recipe.draw, strict=True):
            row.follow(draw)

    def ask_and_run(self) -> None:
        """Ask for a folder where there is none yet, then run or go on."""
        if self.work.folder is None and not self.ask_folder():
            return
        self.work.start()

    def ask_folder(self) -> bool:
        """False: none was chosen."""
        name = f"{self.work.name} images"
        chosen = ask_results_folder(self, "Folder for the images", self._place(), name)
        if chosen is not None:
            self.work.choose_folder(chosen)
        return chosen is not None

    def _make_rows(self) -> None:
        for row in self.rows:
            self.inside.removeWidget(row)
            row.hide()  # it goes when the events have been dealt with, and would stand over the new ones until then
            row.deleteLater()
        base = self.work.base
        self.rows = [
            DrawRow(draw, *((draw.field, PLAIN) if base is None else field_name(base, draw.field)), base)
            for draw in self.work.recipe.draw
        ]
        for number, row in enumerate(self.rows):
            row.chosen.connect(partial(self.work.set_range, number))
            row.removed.connect(partial(self.work.remove, number))
            row.refused.connect(partial(self.session.message.emit, "warning"))
            self.inside.insertWidget(number, row)

    def _fill_files(self, menu: QMenu) -> None:
        menu.clear()
        for name in ready_made():
            menu.addAction(name.replace("_", " ").capitalize(), partial(self.work.load, name))
        menu.addSeparator()
        menu.addAction("Of the open project", self.work.begin_with_project)
        menu.addAction("Open a recipe…", self._open)
        menu.addAction("Save the recipe…", self._save)

    def _fill_fields(self, menu: QMenu) -> None:
        if self.work.base is not None:
            fill_field_menu(menu, self.work.base, self.work.add)

    def _open(self) -> None:
        chosen, _ = QFileDialog.getOpenFileName(self, "Open a recipe", str(self._place()), FILES)
        if chosen:
            self.work.load(Path(chosen))

    def _save(self) -> None:
        name = self.work.name.removesuffix(" recipe")  # a project of the same name may lie there
        suggestion = str(self._place() / f"{name} recipe.json")
        chosen, _ = QFileDialog.getSaveFileName(self, "Save the recipe", suggestion, FILES)
        if chosen:
            self.work.save(Path(chosen))

    def _place(self) -> Path:
        return self.session.place if self.work.recipe.base in DESCRIPTIONS else self.work.root

    def _connect(self) -> None:
        work = self.work
        for box in (self.scenes, self.images, self.image_size, self.seed):
            box.setKeyboardTracking(False)
        self.scenes.valueChanged.connect(work.choose_count)
        self.images.valueChanged.connect(lambda count: work.set_recipe(images=count))
        self.image_size.valueChanged.connect(lambda percent: work.set_recipe(image_scale=percent / 100.0))
        self.seed.valueChanged.connect(lambda seed: work.set_recipe(seed=seed))
        self.foot.choose.clicked.connect(lambda: self.ask_folder())
        self.foot.run.clicked.connect(self.ask_and_run)
        self.foot.stop.clicked.connect(work.stop)
        work.recipe_changed.connect(self.refresh)
        for changed in (work.recipe_changed, work.state_changed):
            changed.connect(self._show_state)
        self.runner.progress.connect(self._tell_progress)

    def _tell_progress(self, job: Job[object]) -> None:
        if job is self.work.job:
            self.foot.tell_progress(job)

    def _show_state(self) -> None:
        work = self.work
        there = work.made()
        images = work.scenes * images_of(work.recipe, len(work.base.scene.lasers) if work.base is not None else 1)
        whole = there >= images and work.is_of_recipe()
        told = f"; {there} are there" if there else ""
        kind = f", {work.kind}" if work.kind else ""
        self.told.setText(f"{images} images of {work.scenes} scenes{kind}{told}{ALL_THERE if whole else ''}")
        self.foot.show_state(work.folder, work.job, begun=there > 0)
        self.foot.run.setEnabled(not whole)
        self.foot.run.setToolTip(f"Every image is there{ALL_THERE}" if whole else "")
        for widget in (self.files, self.scenes, self.images, self.image_size, self.seed, *self.rows):
            widget.setEnabled(not work.running)
        self.add.setEnabled(not work.running and work.base is not None)

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        head.addWidget(self.name, 1)
        head.addWidget(self.files)
        page = QWidget()
        self.inside = QVBoxLayout(page)
        self.inside.setContentsMargins(8, 4, 8, 4)
        self.inside.addStretch(1)
        top = QVBoxLayout()
        top.setContentsMargins(8, 8, 8, 4)
        top.addLayout(head)
        top.addWidget(self.about)
        counts = QFormLayout()
        counts.addRow("Scenes", self.scenes)
        counts.addRow("Images of each", self.images)
        counts.addRow("Size of images", self.image_size)
        counts.addRow("Seed", self.seed)
        foot = QVBoxLayout()
        foot.setContentsMargins(8, 4, 8, 8)
        foot.setSpacing(4)
        foot.addWidget(self.add, 0, Qt.AlignmentFlag.AlignLeft)
        foot.addLayout(counts)
        foot.addWidget(self.told)
        foot.addWidget(self.foot)
        layout = flush(QVBoxLayout(self))
        layout.addLayout(top)
        layout.addWidget(Scrolled(page), 1)
        layout.addLayout(foot)
