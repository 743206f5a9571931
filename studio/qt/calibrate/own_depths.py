"""What the project's own calibration does to depth, worked out in the background while somebody looks at it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

from render.base.errors import InputError
from render.base.threads import Cancel
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.runtime.jobs import Progress

if TYPE_CHECKING:
    from studio.calibration.project_calibration import OwnDepth

LANE = "own calibration"
REST_MS = 300
"""Without a change before it is worked out again."""


class OwnDepths(QObject):
    """Of the session's project, for the panel of results."""

    changed = Signal()
    """`found` or `problem` is another one."""

    def __init__(self, work: CalibrationWork, parent: QObject) -> None:
        super().__init__(parent)
        self.work, self.session = work, work.session
        self.found: list[OwnDepth] | None = None
        """Of each laser; None: not worked out yet, or it cannot be."""
        self.problem = ""
        """Why it cannot be worked out."""
        self._of: tuple[object, object, object] | None = None
        """What `found` or `problem` is of, or what is being worked out."""
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self._begin)

    @property
    def old(self) -> bool:
        """The project is another one than that of `found`, in what decides it."""
        return not self._is_of(self._key())

    def want(self) -> None:
        """Of the project as it is now; `changed` tells when it is there."""
        if self.old:
            self.found, self.problem, self._of = None, "", None
            self._rest.start()

    def _begin(self) -> None:
        from studio.calibration.project_calibration import own_depth

        session, jobs, key = self.session, self.work.jobs, self._key()
        if jobs is None or self._is_of(key):
            return
        self._of = key
        project = session.project.in_folder(session.document.root)

        def work(progress: Progress, cancelled: Cancel) -> list[OwnDepth] | str:
            progress("depth error", 0.0)
            try:
                return own_depth(project)
            except InputError as error:
                return str(error)

        def then(result: list[OwnDepth] | str) -> None:
            if self._is_of(key):
                self.found, self.problem = (None, result) if isinstance(result, str) else (result, "")
                self.changed.emit()

        jobs.run(LANE, "the calibration's depth error", work, then)

    def _key(self) -> tuple[object, object, object]:
        project = self.session.project
        return project.calibration, project.scene, self.session.document.root

    def _is_of(self, key: tuple[object, object, object]) -> bool:
        return self._of is not None and all(one is other for one, other in zip(self._of, key, strict=True))
