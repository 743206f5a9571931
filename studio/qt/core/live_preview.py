"""The live preview that panels share: `live(session)` is made once for a session and follows its project.

    look = live(session).look          # curves, fans and pictures of the project as it is now, each made once
    live(session).changed.connect(...) # another look; at most one for each turn of the event loop

Moves are answered at once; meshes that are not loaded yet are left out of the look until their job has loaded them.
"""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from render.base.threads import Cancel
from render.scene.scene import SceneObject
from studio.preview.inside import inside
from studio.preview.preview import Look, Preview
from studio.preview.problem_fields import problem_fields
from studio.project.project import Project
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, one_of
from studio.runtime.jobs import Progress
from studio.scan.kernel_warm_up import warm_up

LANE = "load meshes"


def live(session: Session) -> Live:
    """The one of this session."""
    return one_of(Live, session)


class Live(QObject):
    """Keeps a `Look` at the session's project."""

    changed = Signal()
    """`look` is another one."""
    loading = Signal(bool)
    """Meshes are being loaded, or have been."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.preview = Preview()
        self._runner = JobRunner(self)
        self._runner.failed.connect(self._load_failed)
        self._told: set[str] = set()
        self._inside: set[str] = set()
        self.ready = False
        """The kernels are compiled. Until then looks are empty, so that the window never waits for a compiler."""
        self._timer = QTimer(self, singleShot=True, interval=0)
        self._timer.timeout.connect(self.refresh)
        session.project_changed.connect(self._timer.start)
        session.document_replaced.connect(self._start_anew)
        session.drag_changed.connect(self._timer.start)
        session.step_changed.connect(self._timer.start)
        self.look = self._looked()
        self._load_missing()

    @property
    def is_loading(self) -> bool:
        """Some of the project's meshes are not in the look yet, but will be."""
        return not self.ready or bool(self.preview.missing(self.session.project, self.session.document.root))

    @property
    def step(self) -> int:
        """Of the motion; what is shown stands where this step puts it."""
        return min(self.session.step, self.session.project.scene.frame_count - 1)

    def look_at(self, project: Project) -> Look:
        """At another project, of what is loaded by now; nothing is waited for."""
        if not self.ready:
            return Look(project, self.step, (), self.preview)
        return self.preview.look(project, self.session.document.root, self.step, wait=False)

    def show_step(self, step: int) -> None:
        """Stand where a step of the motion puts things."""
        self.session.look_at_step(step)

    def refresh(self) -> None:
        """Look now, without waiting for the event loop."""
        self._timer.stop()
        if self.look.project is not self.session.project or self.look.step != self.step or self._incomplete():
            self.look = self._looked()
            self.changed.emit()
        elif not self.session.dragging:
            # the drag has ended: panels may want a finer picture of the same look
            self.changed.emit()
        self._load_missing()

    def close(self) -> None:
        """Stop loading, and wait for the thread."""
        self._timer.stop()
        self._runner.close()

    def _incomplete(self) -> bool:
        return len(self.look.placed) < len(self.session.project.scene.visible_objects)

    def _looked(self) -> Look:
        session = self.session
        look = self.look_at(session.project)
        if not self.ready:
            return look
        for error in self.preview.errors.values():
            if str(error) not in self._told:
                self._told.add(str(error))
                session.message.emit("error", str(error))
        session.tell_problems(problem_fields(look, self.preview.errors))
        self._tell_inside(look)
        return look

    def _tell_inside(self, look: Look) -> None:
        """Camera or lasers that a mesh is around by now, and was not."""
        found = {one.told for one in inside(look) if one.enclosed}
        for told in found - self._inside:
            self.session.message.emit("warning", told)
        whole = len(look.placed) == len(look.scene.visible_objects)
        self._inside = found if whole else self._inside | found

    def _load_missing(self) -> None:
        session, preview, ready = self.session, self.preview, self.ready
        root = session.document.root
        items = preview.missing(session.project, root)
        if (ready and not items) or self._runner.busy:
            return
        triangles_first = sorted(items, key=lambda item: item.shape.kind == "file")

        def work(progress: Progress, cancelled: Cancel) -> list[SceneObject]:
            for i, item in enumerate(triangles_first):
                if cancelled():
                    break
                progress(item.name, i / len(triangles_first))
                preview.load(item, root)
            if not ready and not cancelled():
                warm_up(("look",), progress, cancelled)
            return items

        self.loading.emit(True)
        self._runner.run(LANE, "load meshes", work, self._loaded)

    def _loaded(self, items: list[SceneObject]) -> None:
        self.ready = True
        self.loading.emit(False)
        if not self.session.dragging:
            self.preview.drop_unused(self.session.project, self.session.document.root)
        # the job counts as running until its result has been taken
        self._timer.start()

    def _load_failed(self, job: object) -> None:
        self.loading.emit(False)
        problem = getattr(job, "problem", None)
        self.session.message.emit("error", problem.text if problem is not None else "a mesh could not be loaded")

    def _start_anew(self) -> None:
        self.preview = Preview()
        self._told.clear()
        self._inside.clear()
        self.session.tell_problems({})
        self._timer.start()
