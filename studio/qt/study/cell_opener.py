"""The cell behind a point of a study's chart, rendered again and shown as it was measured: a study keeps numbers alone.

Made once for a session by `one_of`.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from render.base.errors import InputError
from render.base.threads import Cancel
from studio.editing.scene_edits import LASERS
from studio.qt.core.jobs import BUSY, RENDER, JobRunner
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.runtime.jobs import Job, Progress

if TYPE_CHECKING:
    from render.scene.scene import Scene
    from studio.notebook.frame import RenderedFrame
    from studio.study.cells import Cell
    from studio.study.folder_run import Found


UNDER_WAY = "The cell of the study is still being rendered; it will be in the list of renders, and what is shown stays"
READY = "The cell “{}” is ready in the list of renders; a click on its point in the chart opens it in Measure"


class CellOpener(QObject):
    """Shows a cell where a person still waits for it; who has gone on to something else is told that it is there."""

    opened = Signal()
    """A cell is shown: look at it in Measure."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self._waited_for = False
        self._job: Job[RenderedFrame | str] | None = None
        self._looked_at: tuple[Render, Scene] | None = None
        """A cell, and the open project's scene when it came into view."""
        session.renders_changed.connect(self._follow)
        session.project_changed.connect(self._let_go)

    def _follow(self) -> None:
        shown = self.session.shown
        if shown is None or not shown.cell:
            self._looked_at = None
        elif self._looked_at is None or self._looked_at[0] is not shown:
            self._looked_at = shown, self.session.project.scene

    def _let_go(self) -> None:
        """Who changes the scene wants to see it: a cell, which follows no change, would stand in its way."""
        session = self.session
        if self._looked_at is not None and session.project.scene != self._looked_at[1]:
            session.show(next((one for one in reversed(session.renders) if not one.cell), None))

    def go_on(self) -> None:
        """The person does something else: what is being rendered is not to come in between."""
        if self._waited_for and self._job is not None and not self._job.ended:
            self.session.message.emit("info", UNDER_WAY)
        self._waited_for = False

    def open(self, found: Found, number: int, spot: int, jobs: JobRunner) -> None:
        """Show the cell behind a spot of a sweep's chart; one that is among the renders already, at once."""
        session, document = self.session, self.session.document
        cell, scale = found.cell_of(number, spot), found.study.image_scale
        there = next((one for one in session.renders if one.cell == cell.key), None)
        self._look_at_its_laser(found)
        if there is not None:
            session.show(there)
            self.opened.emit()
            return
        if jobs.job(RENDER) is not None:
            session.message.emit("warning", BUSY)
            return

        self._waited_for, before = True, session.shown

        def work(progress: Progress, cancelled: Cancel) -> RenderedFrame | str:
            from studio.notebook.frame import render

            try:
                return render(cell.project, image_scale=scale, progress=progress, cancelled=cancelled)
            except InputError as error:
                return str(error)

        def then(frame: RenderedFrame | str) -> None:
            if isinstance(frame, str):
                session.message.emit("error", frame)
            elif session.document is document:
                self._take(found, number, cell, frame, self._waited_for and session.shown is before)

        self._job = jobs.run(RENDER, "cell of the study", work, then)

    def _look_at_its_laser(self, found: Found) -> None:
        """What is shown of the cell is of the laser that the study measures."""
        laser = found.study.laser
        if len(self.session.project.scene.lasers) > max(laser, 1):
            self.session.select((*LASERS, laser))

    def _take(self, found: Found, number: int, cell: Cell, frame: RenderedFrame, show: bool) -> None:
        from studio.study.labels import value_text

        sweep = found.answers[number].sweep
        pairs, bases = zip(sweep.vary, cell.point, strict=True), found.bases.values()
        values = (value_text(field, value, bases) for field, value in pairs)
        made = Render(
            max([one.number for one in self.session.renders], default=0) + 1,
            frame.project,
            frame.world,
            frame,
            name=f"{sweep.name}: {', '.join(values)}, repeat {cell.repeat + 1}",
            created=time.strftime("%H:%M:%S"),
            image_scale=frame.image_scale,
            source=cell.project,
            cell=cell.key,
        )
        if not show:
            self.session.renders.append(made)
            self.session.renders_changed.emit()
            self.session.message.emit("info", READY.format(made.name))
            return
        self.session.add_render(made)
        told = f"Repeat {cell.repeat + 1} of {found.study.repeats}, rendered again: a study keeps numbers, no frames"
        self.session.message.emit("info", told)
        self.opened.emit()
