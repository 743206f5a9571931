"""The study of a session: the draft, the folder, what was found so far, and the work in the background.

Made once for a session by `one_of`; the panels change it and follow its signals.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from PySide6.QtCore import QTimer, Signal

from render.base.errors import InputError
from render.base.threads import thread_count
from studio.editing.forms import FieldSpec
from studio.project.document import FieldPath
from studio.project.project import Project
from studio.qt.core.jobs import JobRunner
from studio.qt.core.long_work import LongWork
from studio.qt.core.session import Session
from studio.qt.study.first_scale import FirstScale
from studio.qt.study.study_jobs import Ended, estimating, reading, running
from studio.study.as_begun import as_begun, told_apart
from studio.study.draft import Data, by_names, finished, new_draft, path_text, suggested, varies_nothing
from studio.study.estimate import Costs, Estimate
from studio.study.folder_run import Found, in_window, run_into
from studio.study.kept_draft import keep_draft, kept_draft, kept_folder
from studio.study.store import FILE
from studio.study.study import Study, require_laser
from studio.study.study_file import base_name

OF_ANOTHER = "The folder holds a study of another set-up. {}. Choose another folder, or undo the change."
NOT_AS_IT_IS = "it does not go on as it is set up now, which the Study workspace explains; what was measured is kept"
NO_CELL = "no cell was done, and Run begins it again"
SOMETHING = "Something that it is measured on has changed since"
REST_MS = 250
"""Without a change before it is worked out what the study takes."""


class StudyWork(LongWork):
    """Never asks a person anything: what cannot be done is told in `problem`."""

    NAME = "study"

    _grew = Signal(object, object)
    draft_changed = Signal()
    estimated = Signal()
    """`estimate`, or `problem` in its place, or `failure` is another one."""
    found_changed = Signal()
    asked_for = Signal()
    """A field joined the draft."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.unseen = JobRunner(self)
        """Estimates, and reading a folder."""
        self.watched = False
        """Someone looks at the estimate."""
        self.draft, self.loaded = self._begun()
        """loaded: base projects of a study that came from a file; empty: it is of the open project."""
        self.as_it_came = new_draft(self.base_name)
        """The draft before a person changed it, or as it was saved last."""
        self._first_scale = FirstScale(self)
        self.folder = self._kept_folder()
        self._document, self._changed = session.document, False
        """Of which the draft is, and whether it was changed in this window."""
        self.chosen = 0
        """The sweep that is edited and whose chart is shown."""
        self.found: Found | None = None
        self.estimate: Estimate | None = None
        self.problem = ""
        """Why the draft is no study."""
        self.failure = ""
        """Why the last thing that was asked for could not be done."""
        self.promised: float | None = None
        """s of wall time that were told before the run; None: none were."""
        self._told_to_go_on = False
        """The last that was said of it is that Go on continues it."""
        self._timed: dict[str, Costs] = {}
        self._run_bases: dict[str, Project] = {}
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self.look_ahead)
        self._grew.connect(self._take_growth)
        session.project_changed.connect(self._follow_project)
        session.document_replaced.connect(self._follow_document)

    @property
    def base_name(self) -> str:
        """What a study's file calls the open project: a template by its name, else the project's file."""
        return base_name(self.session.document)

    @property
    def kept_with_project(self) -> bool:
        """It is there again when the project is opened again, unless another study takes its place."""
        return self._document.path is not None

    @property
    def sweep(self) -> Data:
        """The one that is edited."""
        sweep: Data = self.draft["sweeps"][self.chosen]
        return sweep

    def project(self) -> Project:
        """The base project of the sweep that is edited."""
        own = self.loaded.get(self.sweep.get("base") or self.draft["base"])
        return own if own is not None else self.session.project

    @property
    def processors(self) -> int:
        """That a run takes."""
        return thread_count(self.engine.workers)

    def study(self) -> Study:
        """InputError: what the draft lacks."""
        return finished(self.draft)

    def bases(self, study: Study) -> dict[str, Project]:
        """Of the study by their names. InputError: one cannot be read, or has no such laser as is measured."""
        names = {study.base, *(sweep.base for sweep in study.sweeps if sweep.base is not None)}
        document = self.session.document
        own = self.session.project.in_folder(document.root)
        missing = {name: own for name in names if name not in self.loaded}
        bases = {**{name: self.loaded[name] for name in names if name in self.loaded}, **missing}
        for name, project in bases.items():
            require_laser(project, study.laser, f"laser, of {name}")
        return bases if self.found is None else as_begun(study, bases, self.found.bases)

    # the draft

    def change(self, edit: Callable[[Data], object]) -> None:
        """Edit the draft; whatever it becomes, it is kept, and `problem` tells what is wrong with it."""
        draft = copy.deepcopy(self.draft)
        edit(draft)
        if draft != self.draft:
            self.chosen = min(self.chosen, len(draft["sweeps"]) - 1)
            self._changed = True
            self.put(draft)

    def put(self, draft: Data) -> None:
        """Another draft of the same study, kept only where a person has changed it."""
        self.draft = draft
        self._keep()
        self.draft_changed.emit()
        self._rest.start()

    def change_sweep(self, **values: Any) -> None:
        """Set fields of the sweep that is edited; None takes one out."""

        def edit(draft: Data) -> None:
            sweep = draft["sweeps"][self.chosen]
            for name, value in values.items():
                if value is None:
                    sweep.pop(name, None)
                else:
                    sweep[name] = value

        self.change(edit)

    def choose_sweep(self, number: int) -> None:
        if number != self.chosen and 0 <= number < len(self.draft["sweeps"]):
            self.chosen = number
            self.draft_changed.emit()
            self.found_changed.emit()

    def vary(self, path: FieldPath, spec: FieldSpec) -> None:
        """A field joins the sweep that is edited."""
        field = path_text(path)
        if all(one["field"] != field for one in self.sweep["vary"]):
            self.change_sweep(vary=[*self.sweep["vary"], suggested(field, spec)])
        self.session.message.emit("info", f"{spec.label} is varied in the study (F12)")
        self.asked_for.emit()

    def set_values(self, row: int, parameter: Data) -> None:
        """Another list or range of a field that is varied."""
        vary = list(self.sweep["vary"])
        vary[row] = parameter
        self.change_sweep(vary=vary)

    def start_anew(self) -> None:
        """An empty study of the open project."""
        self._take({}, new_draft(self.base_name))
        self._changed = True
        self._keep()

    def load(self, path: Path | str) -> None:
        """A study's file, or a ready-made one by its name, with its own base projects."""
        try:
            study, root = Study.load(path)
            bases = study.bases(root)
        except InputError as error:
            self.tell_failure(in_window(error))
            return
        self._take(bases, study.model_dump(mode="json", exclude_defaults=True))

    def use_open_project(self) -> None:
        """The draft asks its questions of the open project."""
        self.loaded = {name: base for name, base in self.loaded.items() if name != self.draft["base"]}
        self.loaded.pop(self.base_name, None)
        self._document = self.session.document
        self.change(lambda draft: draft.update(base=self.base_name))

    # what it takes

    def look(self) -> None:
        """Someone looks: what it takes, once the folder that it was left with is read."""
        self.watched = True
        if self.running:
            return
        if self.found is None and self.folder is not None:
            self._read(self.folder, as_it_is=False)
        else:
            self.look_ahead()

    def look_ahead(self, *, timed: bool = False) -> None:
        """Work out what the draft takes; timed: measure a cell of each sweep for it."""
        self._first_scale.look()
        try:
            study = self.study()
            bases = self.bases(study)
        except InputError as error:
            self.estimate = None
            self.unseen.cancel("estimate")
            # nothing is wrong with a sweep that nobody has filled in yet
            self._tell("" if varies_nothing(self.draft) else self._said(error))
            return
        if self.found is not None and not self.found.is_of(study, bases):
            self.estimate = None
            self.unseen.cancel("estimate")
            self._tell(OF_ANOTHER.format(told_apart(self.found.set_apart(study, bases)) or SOMETHING))
            if self._told_to_go_on and not self.running:
                self._told_to_go_on = False
                self.session.message.emit("info", f"The study was stopped; {NOT_AS_IT_IS}: {self.folder}")
            return
        self._tell("")  # what was wrong before no longer is
        rows = self.found.rows if self.found is not None else {}
        known = self._timed if not timed else {}

        def then(told: Estimate | str) -> None:
            self._timed = known
            self.estimate = told if isinstance(told, Estimate) else None
            self._tell(told if isinstance(told, str) else "")

        work = estimating(study, bases, rows, known, self.processors, timed=timed)
        self.unseen.run("estimate", "estimate", work, then, interrupt=True)

    # the run

    def start(self) -> None:
        """Measure what is missing in the folder; what is there stays, so that this goes on or extends as well."""
        if self.running or self.folder is None or self.jobs is None:
            return
        try:
            study = self.study()
            bases = self.bases(study)
        except InputError as error:
            self.tell_failure(self._said(error))
            return
        grew = partial(self._grew.emit, self.folder)
        work = running(run_into, self.folder, study, bases, self.engine, grew, self._take_start, self._take_there)
        self.tell_failure("")
        self._run_bases = bases
        self.promised = self.estimate.wall(self.processors) if self.estimate is not None else None
        self._begin(work, self._take_end)

    def choose_folder(self, folder: Path) -> None:
        """Where results are kept. One that holds a study: its rows count where they are of the same cells."""
        if self.running:
            return
        self.folder, self.found, self.failure = folder, None, ""
        self._changed = True
        self._keep()
        self.state_changed.emit()
        self.found_changed.emit()
        self._read(folder, as_it_is=False)

    def open_folder(self, folder: Path) -> None:
        """A study that was run before, as its folder holds it."""
        if not self.running:
            self.folder = folder
            self._read(folder, as_it_is=True)

    def close(self) -> None:
        self._keep()  # the project may have become a file since the last change
        self._rest.stop()
        self.unseen.close()

    # what follows

    def _read(self, folder: Path, *, as_it_is: bool) -> None:
        if not as_it_is and not (folder / FILE).exists():
            self.look_ahead()
            return

        def then(ended: Ended) -> None:
            self.tell_failure(ended.problem)
            if ended.found is None:
                return
            if as_it_is:
                self._take(dict(ended.found.bases), ended.found.study.model_dump(mode="json", exclude_defaults=True))
                self.folder, self.found = folder, ended.found
                self.state_changed.emit()
                self.found_changed.emit()
                self.look_ahead()
            elif self.folder == folder:
                self.found = ended.found
                self.found_changed.emit()
                self.look_ahead()

        self.unseen.run("read", "read the study", reading(folder), then)

    def _take(self, bases: dict[str, Project], draft: Data) -> None:
        """Another study in place of this one, which is kept; the other is not before it is changed here."""
        self._keep()
        self._document, self._changed = self.session.document, False
        self.loaded, self.chosen = bases, 0
        self.folder, self.found, self.estimate, self._timed, self.failure = None, None, None, {}, ""
        self.draft = self.as_it_came = {"schema_version": 1, "name": "study", **draft}
        self._first_scale.begin()
        self.draft_changed.emit()
        self.found_changed.emit()
        self.state_changed.emit()
        self.look_ahead()

    def _take_start(self, seconds: float) -> None:
        """On the job's thread: by it the time left is of what cells take, and not of workers that start."""
        if self.job is not None:
            self.job.start_up = seconds

    def _take_there(self, share: float) -> None:
        if self.job is not None:
            self.job.there = share

    def _take_growth(self, folder: Path, found: Found) -> None:
        if folder == self.folder:
            self.found = found
            self.found_changed.emit()

    def _take_end(self, ended: Ended) -> None:
        if ended.found is not None:
            self.session.message.emit("info", f"The study is done: {self.folder}")
        self.tell_failure(ended.problem)

    def _after_run(self) -> None:
        self.look_ahead()

    def _how_on(self) -> str:
        begun = self.found is not None and bool(self.found.rows)
        self._told_to_go_on = begun and not self.problem
        return NOT_AS_IT_IS if self.problem else super()._how_on() if begun else NO_CELL

    def _said(self, error: InputError) -> str:
        return by_names(in_window(error), self.draft)

    def tell_failure(self, failure: str) -> None:
        """What could not be done; empty: nothing."""
        self.failure = failure
        self.estimated.emit()

    def _tell(self, problem: str) -> None:
        self.problem = problem
        self.estimated.emit()

    def _follow_project(self) -> None:
        if self.watched and not self.loaded:
            self._rest.start()

    def _follow_document(self) -> None:
        """A study of the project that was open goes on, as it began, and is kept with that project; one that has not
        begun is of the new one.
        """
        self._keep()  # the document before may have become a file since the last change
        if self.loaded:
            return
        if self.running or self.found is not None:
            self.loaded = dict(self.found.bases) if self.found is not None else self._run_bases
        else:
            draft, bases = self._begun()
            self._take(bases, draft)
            self.as_it_came, self.folder = new_draft(self.base_name), self._kept_folder()
            self.state_changed.emit()
            if self.watched:
                self.look()

    def _kept_folder(self) -> Path | None:
        path = self.session.document.path
        return kept_folder(path) if path is not None else None

    def _begun(self) -> tuple[Data, dict[str, Project]]:
        """The study of the open project as it was left, with its own base projects, else an empty one."""
        path = self.session.document.path
        kept = kept_draft(path, self.base_name) if path is not None else None
        return kept or (new_draft(self.base_name), {})

    def _keep(self) -> None:
        path = self._document.path
        if path is not None and self._changed:
            keep_draft(path, self.draft, self.folder, self.loaded)
