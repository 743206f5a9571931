"""The steps of a scan that is looked at: read and placed one at a time, in the background.

    scan_steps(session).show(found, source, scale)  # the scan joins the renders; the session's step is shown of it

Made once for a session. Whoever looks at another step moves `session.step`.
"""

from __future__ import annotations

import time
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from render.base.errors import InputError
from render.base.threads import Cancel
from render.frame import Frame
from render.world.world import World
from studio.project.project import Project
from studio.qt.core.jobs import JobRunner
from studio.qt.core.render import Render
from studio.qt.core.session import Session, one_of
from studio.runtime.jobs import Job, Progress
from studio.scan.scan_folder import ScanFolder
from studio.scan.scan_results import read_results

LANE = "read a step"


def scan_steps(session: Session) -> ScanSteps:
    """The one of this session."""
    return one_of(ScanSteps, session)


def awaits_step(session: Session) -> bool:
    """The session's step of the shown scan is still to be read: what is shown is the one looked at before."""
    shown = session.shown
    if shown is None or shown.scan is None or session.changed or scan_steps(session).problem:
        return False
    return session.step < shown.scan.count and shown.frame.step != session.step


class ScanSteps(QObject):
    """Keeps the shown scan at the session's step."""

    told = Signal()
    """`problem` is another one."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.problem = ""
        """Why the step cannot be shown."""
        self.measured: dict[Path, Project] = {}
        """By a scan's folder, as it was measured again in this session, calibration and laser powers included."""
        self.runner = JobRunner(self)
        self.runner.failed.connect(self._fail)
        session.step_changed.connect(self.follow)
        session.renders_changed.connect(self.follow)
        session.document_replaced.connect(lambda: self.runner.cancel(LANE))

    def show(self, found: ScanFolder, source: Project | None = None, image_scale: float = 1.0) -> None:
        """A finished scan joins the renders and is shown. source: the open project at full scale, of which the scan is
        at `image_scale`; None: the open project is the scan's own."""
        session, document, step = self.session, self.session.document, self.session.step
        number = max([render.number for render in session.renders], default=0) + 1

        def work(progress: Progress, cancelled: Cancel) -> Render:
            scan = read_results(found, cancelled)
            frame, world = scan.read_step(min(step, scan.count - 1), None)
            made = Render(number, found.project, world, frame, image_scale=image_scale, source=source, scan=scan)
            made.name, made.created = f"Scan “{found.folder.resolve().name}”", time.strftime("%H:%M:%S")
            return made

        def then(made: Render) -> None:
            if session.document is document:
                session.add_render(made)

        # a lane of its own: a step asked for meanwhile must not take its place
        self.runner.run("open a scan", f"open {found.folder.name}", work, then)

    def measured_as(self, render: Render) -> Project:
        """The project, at the scan's image scale, by which all steps of a shown scan were measured last."""
        assert render.scan is not None
        try:
            return self.measured.get(render.scan.found.folder) or render.scan.measured_as
        except InputError:
            return render.project

    def follow(self) -> None:
        """Read the session's step of the shown scan, where that is not what is shown."""
        render, step = self.session.shown, self.session.step
        if render is None or render.scan is None:
            self._tell("")
            return
        scan, world = render.scan, render.world
        step = min(step, scan.count - 1)
        if render.frame.step == step:
            return

        def work(progress: Progress, cancelled: Cancel) -> tuple[Frame, World]:
            return scan.read_step(step, world)

        def then(read: tuple[Frame, World]) -> None:
            self._tell("")
            self.session.look_at_scan(scan, *read)

        self.runner.run(LANE, f"read step {step + 1}", work, then)

    def close(self) -> None:
        """Stop reading, and wait for the thread."""
        self.runner.close()

    def _fail(self, job: Job[object]) -> None:
        text = job.problem.text if job.problem is not None else f"{job.name} failed"
        self._tell(text)
        self.session.message.emit("error", text)

    def _tell(self, problem: str) -> None:
        if problem != self.problem:
            self.problem = problem
            self.told.emit()
