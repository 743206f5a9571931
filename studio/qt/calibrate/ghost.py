"""The board where it is to be held next, handed to the 3D view."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QObject

from studio.calibration.drawings import advised_pose, dark_shapes, in_space
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.core.session import Session, one_of


class Ghost(QObject):
    """Follows the calibration: no ghost where there is none, where nothing is advised, or where it is enough.

    Nor of virtual boards, which nobody holds: they are taken at a click, in the camera's image.
    """

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session, self.work = session, one_of(CalibrationWork, session)
        self.work.solved_changed.connect(self.refresh)

    def refresh(self) -> None:
        solved, target_um = self.work.solved, self.work.target_um
        advice = None if solved is None else solved.result.advice
        enough = advice is not None and target_um is not None and 1e6 * advice.before <= target_um
        if solved is None or advice is None or enough or self.work.virtual:
            self.session.show_ghost(np.zeros((0, 4, 3)))
            return
        self.session.show_ghost(in_space(dark_shapes(solved.board), *advised_pose(advice, solved.board)))
