"""Whether the figures of the shown render are still of the sensor settings before: measuring takes its time."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject, QTimer, Signal

from studio.qt.core.session import Session
from studio.scan.redevelop import development

NOTICED_MS = 300
"""What is measured sooner is not worth a word."""


class FiguresAge(QObject):
    """Made once for a session by `one_of`."""

    changed = Signal(bool)
    """`old` is another."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.old = False
        self._timer = QTimer(self, singleShot=True, interval=NOTICED_MS)
        self._timer.timeout.connect(lambda: self._tell(self._behind()))
        for changed in (session.project_changed, session.renders_changed, session.measured):
            changed.connect(self._follow)
        self._follow()

    def give_up(self) -> None:
        """It could not be measured, which is told elsewhere: nothing is on its way."""
        self._timer.stop()
        self._tell(False)

    def _follow(self) -> None:
        if not self._behind():
            self._timer.stop()
            self._tell(False)
        elif not self.old and not self._timer.isActive():
            self._timer.start()

    def _behind(self) -> bool:
        """Of light that is still to come the settings decide alone: its frame is always ahead of the figures."""
        render = self.session.shown
        made = None if render is None else render.made_from.get("measurements")
        if render is None or made is None:
            return False
        how = development(render.project, render.developed_by(self.session.project), render.image_scale)
        # measures of the part are read off at once, and change no figure
        before = replace(made[1], project=made[1].project.read_as(how.project))
        return before != how

    def _tell(self, old: bool) -> None:
        if old != self.old:
            self.old = old
            self.changed.emit(old)
