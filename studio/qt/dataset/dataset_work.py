"""The dataset of a session: its recipe, the pictures of its first scenes, and the work in the background.

Made once for a session by `one_of`; the panels change it and follow its signals.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QTimer, Signal

from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.threads import Cancel
from studio.dataset.contact_sheet import Picture, pictures
from studio.dataset.folder import images_in, is_of
from studio.dataset.image_kind import image_kind, notes_of_depth
from studio.dataset.own_recipe import check_place, recipe_of, suggested_draw
from studio.dataset.recipe import Recipe, base_of
from studio.dataset.run import Result, Wanted, make_dataset
from studio.dataset.written import written_pictures
from studio.editing.forms import FieldSpec
from studio.project.document import FieldPath
from studio.project.project import Project
from studio.project.project_files import check_no_project
from studio.project.strict_json import pretty
from studio.qt.core.jobs import JobRunner
from studio.qt.core.long_work import LongWork
from studio.qt.core.session import Session
from studio.runtime.jobs import Progress
from studio.study.draft import path_text
from studio.study.folder_run import in_window

REST_MS = 400
"""Without a change before the scenes are drawn anew."""
SHOWN = 24
"""Scenes on the live sheet."""
AGAIN_MS = 3000
"""Until a folder that is being filled is looked into again."""
FIRST = "primitives"


class DatasetWork(LongWork):
    """Never asks a person anything: what cannot be done is told in `problem`."""

    NAME = "dataset"

    _ready = Signal(object, object)
    recipe_changed = Signal()
    pictures_changed = Signal()
    """`pictures`, or `problem`, is another one."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.unseen = JobRunner(self)
        """The pictures."""
        self.watched = False
        """Someone looks at them."""
        self.name = FIRST
        self.recipe, self.root = Recipe.load(FIRST)
        self.base: Project | None = None
        """The recipe's base project; None: it cannot be read."""
        self.scenes = 100
        self.shown = SHOWN
        self.pictures: dict[int, Picture] = {}
        """Of `recipe` as it is, by their numbers, as far as they are ready."""
        self.drawing = False
        self.written: list[Picture] = []
        """The first images of the folder."""
        self.shows_written = False
        """They are on the sheet, and not the recipe's scenes."""
        self.problem = ""
        """Why the scenes cannot be drawn, or the run could not go on."""
        self._stale = True
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self.draw)
        self._ready.connect(self._take_picture)
        self._again = QTimer(self, interval=AGAIN_MS)
        self._again.timeout.connect(self.read_written)
        self._read_base()

    def load(self, path: Path | str) -> None:
        """A recipe's file, or a ready-made one by its name."""
        try:
            recipe, root = Recipe.load(path)
        except InputError as error:
            self._tell(in_window(error))
            return
        self.name, self.root, self.folder = Path(path).stem, root, None
        self._change(recipe)
        self.state_changed.emit()

    def begin_with_project(self) -> None:
        """A recipe of the open project, as it was saved, that draws nothing yet."""
        document = self.session.document
        if document.path is None:
            self.session.message.emit("warning", "Save the project first: its recipe names the project's file")
            return
        recipe, self.root = recipe_of(document.path, document.project.name)
        self.name, self.folder = f"{document.path.stem} recipe", None
        self._change(recipe)
        self.state_changed.emit()
        if document.dirty:
            self.session.message.emit("warning", "The recipe is of the project as it was saved, without later changes")

    def add(self, path: FieldPath, spec: FieldSpec) -> None:
        """Another field is drawn."""
        field = path_text(path)
        if any(one.field == field for one in self.recipe.draw):
            self.session.message.emit("info", f"{spec.label} is drawn already")
            return
        draws = [*self.recipe.draw, suggested_draw(field, spec)]
        fixed = {name: value for name, value in self.recipe.set.items() if name != field}
        self.set_recipe(draw=[one.model_dump() for one in draws], set=fixed)

    def remove(self, number: int) -> None:
        """A field is as in the base project again."""
        self.set_recipe(draw=[one.model_dump() for k, one in enumerate(self.recipe.draw) if k != number])

    def set_range(self, number: int, low: float, high: float) -> None:
        """Another range of a field that is drawn."""
        self._replace(number, {"low": low, "high": high})

    def set_recipe(self, **values: object) -> None:
        """Others of the recipe's own values, as its seed."""
        self._checked({**self.recipe.model_dump(), **values})

    def look(self) -> None:
        """Someone looks: draw the scenes if they are not those of the recipe."""
        self.watched = True
        if self._stale:
            self._rest.start()

    def draw(self) -> None:
        """The first scenes of the recipe, one by one as they are ready."""
        recipe, root, count, ready = self.recipe, self.root, self.previewed, partial(self._ready.emit, self.recipe)

        def work(progress: Progress, cancelled: Cancel) -> str:
            try:
                for picture in pictures(recipe, root, count, cancelled):
                    ready(picture)
                    progress("scenes", (picture.number + 1) / count)
            except InputError as error:
                return in_window(error)
            return ""

        self._stale, self.drawing = False, True
        self.pictures = {}
        self._tell("")
        self.unseen.run("pictures", "contact sheet", work, self._end_drawing, interrupt=True)

    def save(self, file: Path) -> bool:
        """Write the recipe's file; False: told in `problem`, nothing is written."""
        data = self.recipe.model_dump(mode="json", exclude_defaults=True)
        try:
            check_place(self.recipe, self.root, file.parent)
            check_no_project(file, "recipe")
            with atomic_write(file) as temporary:
                temporary.write_text(pretty({"schema_version": 1, **data}) + "\n", encoding="utf-8")
        except InputError as error:
            self._tell(in_window(error))
            return False
        self.session.message.emit("info", f"Saved the recipe: {file}")
        return True

    def choose_folder(self, folder: Path) -> None:
        """Where the images go; a dataset of this recipe that is there is gone on with."""
        self.folder, self.written, self.shows_written = folder, [], False
        self.state_changed.emit()
        self.read_written()

    def show_written(self, on: bool) -> None:
        """The images of the folder on the sheet, or the recipe's scenes."""
        self.shows_written = on and bool(self.written)
        self.pictures_changed.emit()
        if not self.shows_written and self.watched:
            self.look()

    def read_written(self, *, show: bool = False) -> None:
        """The first images that the folder holds now; show: on the sheet."""
        folder, count = self.folder, self.shown

        def work(progress: Progress, cancelled: Cancel) -> list[Picture]:
            if folder is None or not folder.is_dir():
                return []
            return list(written_pictures(folder, images_in(folder)[:count], cancelled))

        def then(found: list[Picture]) -> None:
            if folder == self.folder:
                self.written = found
                self.shows_written = bool(found) and (show or self.shows_written)
                self.pictures_changed.emit()

        self.unseen.run("written", "written images", work, then, interrupt=True)

    def choose_count(self, scenes: int) -> None:
        """More than are drawn of them draw the others; fewer are looked at without drawing any."""
        before, self.scenes = self.previewed, scenes
        self.state_changed.emit()
        self.pictures_changed.emit()
        if self.previewed > max(before, len(self.pictures)):
            self._stale = True
            if self.watched:
                self._rest.start()

    @property
    def previewed(self) -> int:
        """Scenes that are looked at: the first ones, and no more than are asked for."""
        return min(self.shown, self.scenes)

    @property
    def on_sheet(self) -> dict[int, Picture]:
        """By their places, as far as they are ready."""
        return dict(enumerate(self.written)) if self.shows_written else self.pictures

    @property
    def places(self) -> int:
        """Of the sheet."""
        return len(self.written) if self.shows_written else self.previewed

    @property
    def kind(self) -> str:
        """Size and bits of the images; empty: the base project cannot be read."""
        return "" if self.base is None else image_kind(self.recipe, self.base)

    def made(self) -> int:
        """Images that the folder holds whole."""
        return len(images_in(self.folder)) if self.folder is not None and self.folder.is_dir() else 0

    def is_of_recipe(self) -> bool:
        """The folder holds images of the recipe as it is."""
        try:
            return self.folder is not None and self.base is not None and is_of(self.folder, self.recipe, self.base)
        except InputError:  # told where the images are made
            return False

    def start(self) -> None:
        """Make what is missing in the folder."""
        if self.running or self.folder is None or self.jobs is None:
            return
        recipe, root, folder, wanted, engine = self.recipe, self.root, self.folder, Wanted(self.scenes), self.engine

        def work(progress: Progress, cancelled: Cancel) -> Result | str:
            try:
                return make_dataset(
                    recipe, root, wanted, folder, engine=engine, cancelled=cancelled,
                    progress=lambda done, known: progress(f"scene {done} of {known}", done / max(known, 1)),
                )  # fmt: skip
            except InputError as error:
                return in_window(error)

        self._tell("")
        self._again.start()
        self._begin(work, self._take_end)

    def close(self) -> None:
        self._rest.stop()
        self._again.stop()
        self.unseen.close()

    def _replace(self, number: int, values: dict[str, object]) -> None:
        draws = [one.model_dump() for one in self.recipe.draw]
        draws[number].update(values)
        self._checked({**self.recipe.model_dump(), "draw": draws})

    def _checked(self, data: dict[str, object]) -> None:
        from pydantic import ValidationError

        from studio.project.validation_messages import input_error

        try:
            recipe = Recipe.model_validate(data)
        except ValidationError as error:
            self._tell(in_window(input_error(error, Recipe, data, self.recipe.name)))
            return
        if recipe != self.recipe:
            self._change(recipe)

    def _change(self, recipe: Recipe) -> None:
        self.recipe, self._stale, self.shows_written = recipe, True, False
        if self.folder is None:
            self.written = []
        self._read_base()
        self.recipe_changed.emit()
        if self.watched:
            self._rest.start()

    def _read_base(self) -> None:
        try:
            self.base = base_of(self.recipe, self.root)
        except InputError:  # told by the pictures, which need it as well
            self.base = None

    def _take_picture(self, recipe: Recipe, picture: Picture) -> None:
        if recipe is self.recipe:
            self.pictures[picture.number] = picture
            self.pictures_changed.emit()

    def _end_drawing(self, problem: str) -> None:
        self.drawing = False
        self._tell(problem)

    def _after_run(self) -> None:
        self._again.stop()
        self.read_written(show=self.is_of_recipe())

    def _take_end(self, ended: Result | str) -> None:
        if isinstance(ended, str):
            self._tell(ended)
        else:
            told = f"The dataset is done: {ended.images} images in {self.folder}"
            dataset = ended.dataset
            self.session.message.emit("info", "\n".join([told, *notes_of_depth(dataset.recipe, dataset.base)]))

    def _tell(self, problem: str) -> None:
        self.problem = problem
        self.pictures_changed.emit()
