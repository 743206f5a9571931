"""Measure the scan again: points, measures and report of all its steps as the project asks now, without a render."""

from __future__ import annotations

from PySide6.QtCore import QObject

from render.base.errors import InputError
from render.base.threads import Cancel
from studio.qt.core.actions import Actions
from studio.qt.core.jobs import JobRunner
from studio.qt.core.render import Render
from studio.qt.core.scan_progress import scan_progress
from studio.qt.core.scan_steps import scan_steps
from studio.qt.core.session import Session
from studio.runtime.jobs import Progress
from studio.scan.redevelop import development
from studio.scan.scan_folder import open_folder
from studio.scan.stages import Clock

LANE, KEY = "measure a scan", "measure_scan"


class ScanAgain(QObject):
    """Of the scan that is shown; what its folder held of points goes once the new ones are there."""

    def __init__(self, session: Session, runner: JobRunner, actions: Actions) -> None:
        super().__init__(session)
        self.session, self.runner, self.actions = session, runner, actions
        actions.connect(KEY, self.run)
        session.renders_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        render = self.session.shown
        self.actions[KEY].setEnabled(render is not None and render.scan is not None)

    def run(self) -> None:
        """In the background; cancelled while frames are measured, all is as it was."""
        session, document, render = self.session, self.session.document, self.session.shown
        scan = None if render is None else render.scan
        if render is None or scan is None:
            return
        now = render.developed_by(session.project)
        how, folder = development(render.project, now, render.image_scale), scan.found.folder
        root = document.root  # as it is now: the delivery is the project's of now as well

        def work(progress: Progress, cancelled: Cancel) -> None:
            from studio.scan.whole_scan import measure_scan_again  # takes a while: not before a scan

            measure_scan_again(scan, how.powered, root, Clock(scan_progress(progress, scan.count), cancelled))

        def then(_: None) -> None:
            scan_steps(session).measured[folder] = how.powered
            session.message.emit("info", f"All {scan.count} steps were measured again: {folder}")
            if session.document is document:
                self._show(render)

        self.runner.run(LANE, "measure the scan again", work, then, interrupt=True)

    def _show(self, before: Render) -> None:
        """In place of what was shown, whose figures its folder no longer has."""
        session, scan = self.session, before.scan
        assert scan is not None
        try:
            found = open_folder(scan.found.folder)
        except InputError as error:
            session.message.emit("error", str(error))
            return
        # another step of it may have been looked at meanwhile
        session.renders = [render for render in session.renders if render.scan is not scan]
        scan_steps(session).show(found, before.source, before.image_scale)
