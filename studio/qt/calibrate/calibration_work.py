"""The calibration of a session: photographs or virtual boards, which of them count, and the work in the background.

Made once for a session by `one_of`; the panels change it and follow its signals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from PySide6.QtCore import QObject, QTimer, Signal

from render.base.errors import Cancelled, InputError
from render.base.threads import Cancel
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session
from studio.runtime.jobs import Job, Progress

if TYPE_CHECKING:
    from analysis.calibration.board import Board
    from analysis.calibration.estimate import Estimate
    from analysis.calibration.motion import Held
    from analysis.calibration.recheck import Recheck
    from studio.calibration.image_views import Shot
    from studio.calibration.material import Material
    from studio.calibration.solving import Solved
    from studio.calibration.view_residuals import Residuals

LANE = "calibration"
"""Photographs take minutes: renders go on beside them."""
REST_MS = 250
"""Without a change before the rest is adjusted again."""
What = Literal["scanner", "camera", "laser", "check"]
BOARD = "checkerboard:13x9:25mm"


class CalibrationWork(QObject):
    """Never asks a person anything: what cannot be done is told in `problem`."""

    material_changed, solved_changed, counted_changed, shown_changed = Signal(), Signal(), Signal(), Signal()
    """`material`, `solved` or `checked`, `dropped`, `shown` is another one, or none."""
    state_changed = Signal()
    """Work began or ended, `problem` is another one, or what is asked for."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.jobs: JobRunner | None = None
        self.board_text = BOARD
        self.what: What = "scanner"
        self.terms: int | None = None
        """Distortion terms; None: chosen by views that are held out."""
        self.target_um: float | None = None
        """Depth error that is enough."""
        self.nearest: float | None = None
        self.farthest: float | None = None
        """m, between which depth is measured; None: as far as the boards are."""
        self.camera_file: Path | None = None
        """Of the camera that is held, for lasers alone, or of the calibration that is checked."""
        self.motion_file: Path | None = None
        """Of what carried the board between photographs; None: nothing did."""
        self.holds: Held = "camera"
        self.shots: list[Shot] = []
        self.source = ""
        """Where the views are from, as it is shown."""
        self.material: Material | None = None
        self.virtual = False
        """The views are of the project, not of photographs."""
        self.truth: Estimate | None = None
        self.dropped: set[str] = set()
        self.solved: Solved | None = None
        self.kept: Solved | None = None
        """What was saved or used last: closing loses nothing of it."""
        self.note = ""
        """Why the advised view did not bring what it was to."""
        self._advised_terms: int | None = None
        """Of the lens for which the view that was taken had been advised."""
        self.checked: Recheck | None = None
        """Whether the calibration that was chosen still holds."""
        self.shown = ""
        """The view that is looked at."""
        self.problem = ""
        self.job: Job[Any] | None = None
        self._with_lines = False
        """Lines were looked for in the photographs."""
        self._unread: list[Shot] = []
        self._turn = 0
        """Counts what was begun: the result of all but the last is no longer wanted."""
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self.solve)
        session.document_replaced.connect(self._follow_document)

    def attach(self, jobs: JobRunner) -> None:
        """Work is done by the window's runner."""
        self.jobs = jobs
        for ended in (jobs.cancelled, jobs.failed):
            ended.connect(self._end)

    @property
    def running(self) -> bool:
        return self.job is not None

    def board(self) -> Board | None:
        """None: what was typed is none, which is told."""
        from studio.calibration.board_text import parse_board
        from studio.calibration.solving import in_window

        try:
            return parse_board(self.board_text.strip())
        except InputError as error:
            self._fail(in_window(error))
            return None

    # where the views come from

    def open_folder(self, folder: Path) -> None:
        """The photographs of a folder in place of what was there."""
        from studio.calibration.image_views import shots

        try:
            taken = shots(folder)
        except (InputError, OSError) as error:
            self.tell(str(error))
            return
        self._forget()
        self.source, self.shots = str(folder), taken
        self._read(taken)

    def add(self, files: Sequence[Path]) -> None:
        """Single photographs join those that are there, each with the others of its pose beside it."""
        from studio.calibration.material import new_shots

        try:
            new = new_shots(files, self.shots)
        except (InputError, OSError) as error:
            self.tell(str(error))
            return
        if self.virtual or not self.shots:
            self._forget()
            self.source = str(files[0].parent)
        self.shots += new
        self._read([*self._unread, *new])

    def simulate(self) -> None:
        """Virtual boards before the open project's camera, as `main.py calibrate PROJECT` has them."""
        from studio.calibration.material import virtual
        from studio.calibration.solving import in_window

        project, nearest, farthest = self.session.project, self.nearest, self.farthest
        project = project.in_folder(self.session.document.root)
        board = self.board()
        if board is None:
            return

        def work(progress: Progress, cancelled: Cancel) -> tuple[Material, Estimate] | str:
            try:
                return virtual(project, board, nearest, farthest)
            except InputError as error:
                return in_window(error)

        def then(made: tuple[Material, Estimate] | str) -> None:
            if isinstance(made, str):
                self._fail(made)
                return
            self.truth = made[1]
            self._take(made[0])

        self._forget()
        self.virtual, self.source = True, f"{project.name}, virtual boards"
        self._start("virtual boards", work, then)

    def follow_advice(self) -> None:
        """One more virtual board, where the next pose is advised."""
        from studio.calibration.material import as_advised

        solved = self.solved
        if self.material is None or self.truth is None or solved is None or solved.result.advice is None:
            return
        try:
            material = as_advised(self.material, self.truth, solved.result.advice, solved.board)
        except InputError as error:
            self.tell(str(error))
            return
        self._advised_terms = len(solved.result.estimate.distortion)
        self._take(material)

    def choose_board(self, text: str) -> None:
        if text.strip() != self.board_text:
            self.board_text = text.strip()
            self._anew()

    def choose_what(self, what: What, camera_file: Path | None = None) -> None:
        """What is calibrated or checked; camera_file: of the camera that is held, or of what is checked."""
        self.what, self.camera_file = what, camera_file
        if self.shots and what != "camera" and not self._with_lines:
            self._anew()
        else:
            self.solve()

    def choose_terms(self, terms: int | None) -> None:
        self.terms = terms
        self.solve()

    def choose_motion(self, file: Path | None, holds: Held = "camera") -> None:
        """The table of what carried the board, and what a robot's hand holds."""
        self.motion_file, self.holds = file, holds
        self.solve()

    def choose_range(self, nearest: float | None, farthest: float | None) -> None:
        """m, between which depth is measured, and virtual boards are held."""
        self.nearest, self.farthest = nearest, farthest
        self._anew() if self.virtual else self.solve()

    def choose_target(self, target_um: float | None) -> None:
        self.target_um = target_um
        self.solved_changed.emit()

    # which of them count

    def drop(self, name: str, *, dropped: bool) -> None:
        """Leave a view out, or take it in again; the rest is adjusted anew."""
        before = set(self.dropped)
        self.dropped = self.dropped | {name} if dropped else self.dropped - {name}
        if before != self.dropped:
            self.counted_changed.emit()
            self._rest.start()

    def show(self, name: str) -> None:
        """Look at another view."""
        if name == self.shown:
            return
        self.shown = name
        self.shown_changed.emit()

    def residuals(self) -> Residuals | None:
        """Of the view that is looked at; None: it has none."""
        rows = () if self.solved is None else self.solved.rows
        return next((found for row, found in rows if row.name == self.shown), None)

    def shot(self) -> Shot | None:
        """The photographs of the view that is looked at."""
        return next((shot for shot in self.shots if shot.name == self.shown), None)

    # the calibration

    def solve(self) -> None:
        """Adjust what counts, or hold it against the calibration that is checked."""
        from studio.qt.calibrate.asked import task_of

        if self.material is None or self._unread:
            return  # it follows when they are read
        board = self.board()
        if board is None:
            return
        try:
            task = task_of(self, self.material, board)
        except InputError as error:
            self._fail(str(error))
            return
        self._start("calibration", task, self._take_solved)

    def tell(self, problem: str) -> None:
        """What could not be done, in place of what was told before; empty: nothing."""
        self.problem = problem
        self.state_changed.emit()

    def stop(self) -> None:
        """What was found before stays."""
        if self.jobs is not None:
            waits = self.jobs.job(LANE) is not self.job
            self.jobs.cancel(LANE)
            self._end(self.job if waits else None)
            self.state_changed.emit()

    def close(self) -> None:
        self._rest.stop()

    # what follows

    def _anew(self) -> None:
        """The same photographs or project, looked at again."""
        if self.virtual:
            self.simulate()
        elif self.shots:
            shots, source = self.shots, self.source
            self._forget()
            self.shots, self.source = shots, source
            self._read(shots)
        else:
            self.tell("")

    def _read(self, taken: Sequence[Shot]) -> None:
        from analysis.line.extract import settings_of
        from studio.calibration.material import photographed

        lasers, before = self.what != "camera", self.material
        settings = settings_of(None, axis=self.session.project.extraction.axis, channel="auto")
        board = self.board()
        if board is None:
            return

        def work(progress: Progress, cancelled: Cancel) -> Material | str:
            def tell(done: float) -> None:
                if cancelled():
                    raise Cancelled
                progress(f"photograph {min(round(done * len(taken)) + 1, len(taken))} of {len(taken)}", done)

            try:
                found = photographed(taken, board, settings, lasers=lasers, progress=tell)
                return found if before is None else before.joined(found)
            except InputError as error:
                return str(error)

        def then(found: Material | str) -> None:
            self._unread = []
            if isinstance(found, str):
                if before is not None:  # what was there before stays as it was
                    self.shots = [shot for shot in self.shots if shot not in taken]
                    self.tell(found)
                else:
                    self._fail(found)
            else:
                self._take(found)

        self._unread, self._with_lines = list(taken), lasers
        self._start("look for boards", work, then)

    def _start(self, name: str, work: Callable[[Progress, Cancel], Any], then: Callable[[Any], None]) -> None:
        if self.jobs is None:
            return
        self._rest.stop()
        self.problem = ""
        self._turn += 1
        turn = self._turn

        def end(result: Any) -> None:
            if turn == self._turn:
                self.job = None
                then(result)
                self.state_changed.emit()

        self.job = self.jobs.run(LANE, name, work, end, interrupt=True)
        self.state_changed.emit()

    def _take(self, material: Material) -> None:
        self.material = material
        if self.shown not in {view.name for view in material.views}:
            self.shown = material.views[0].name
        self.material_changed.emit()
        self.shown_changed.emit()
        self.solve()

    def _take_solved(self, found: Solved | Recheck | str) -> None:
        from studio.calibration.solving import Solved

        if isinstance(found, str):
            self._fail(found)
            return
        before, self._advised_terms, self.note = self._advised_terms, None, ""
        self.solved, self.checked = (found, None) if isinstance(found, Solved) else (None, found)
        if isinstance(found, Solved) and before not in (None, now := len(found.result.estimate.distortion)):
            self.note = (
                f"The lens has {now} distortion terms now, and had {before} when this view was advised: what it was to "
                "gain was foretold for that one."
            )
        self.solved_changed.emit()

    def _forget(self) -> None:
        """What is there goes; what is asked for stays."""
        if self.jobs is not None:
            self.jobs.cancel(LANE)
        self._rest.stop()
        self._turn += 1
        self.job, self._unread = None, []
        self.shots, self.source, self.dropped, self.shown, self.virtual = [], "", set(), "", False
        self.material, self.truth, self.solved, self.checked = None, None, None, None
        self.material_changed.emit()
        self.solved_changed.emit()
        self.shown_changed.emit()

    def _end(self, job: object) -> None:
        if job is not None and job is self.job:
            self.shots = [shot for shot in self.shots if shot not in self._unread]
            self.job, self._unread = None, []
            self.source = self.source if self.shots or self.virtual else ""
            self.state_changed.emit()

    def _fail(self, problem: str) -> None:
        """There is no calibration, and why."""
        self.solved = self.checked = None
        self.solved_changed.emit()
        self.tell(problem)

    def _follow_document(self) -> None:
        """Photographs stay; virtual boards were of the project that was open."""
        if self.virtual:
            self._forget()
