"""The panels of the workspace Calibrate beside each other, and virtual boards for them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
from pytestqt.qtbot import QtBot

from analysis.calibration.virtual import noisy
from studio.calibration.material import Material
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.calibrate.board_view import BoardView
from studio.qt.calibrate.calibrate_panel import CalibratePanel
from studio.qt.calibrate.calibration_work import CalibrationWork
from studio.qt.calibrate.result_panel import CalibrationPanel
from studio.qt.core.jobs import JobRunner
from studio.qt.core.session import Session, one_of
from tests.analysis.calibration.boards import SIZE, truth, views_of

VIEWS = 8
LINE = "blue line"
"""Name of the laser."""


CORNER = np.array([0.15, 0.1])
THERE = truth(3, VIEWS, tilt=(15.0, 35.0))


@cache
def seen() -> Material:
    """Corners and lines with noise, of boards that no photograph shows."""
    drawn = noisy(views_of(THERE, laser_step=64), np.random.default_rng(3))
    # from the first corner, as a board has them, not from its middle
    return Material(tuple(replace(view, target=view.target + CORNER) for view in drawn), SIZE, 1, names=(LINE,))


class Desk:
    """The panels of the workspace."""

    def __init__(self) -> None:
        folder = template_folder("plane")
        self.session = Session(Document(Project.load(folder / "project.json"), root=folder))
        self.runner = JobRunner(self.session)
        self.panel, self.boards = CalibratePanel(self.session, self.runner), BoardView(self.session)
        self.found = CalibrationPanel(self.session)
        self.work = one_of(CalibrationWork, self.session)
        self.work.terms = 0

    def close(self) -> None:
        for panel in (self.panel, self.boards, self.found):
            panel.close()
        self.runner.close()


def settled(qtbot: QtBot, desk: Desk) -> None:
    work = desk.work
    qtbot.waitUntil(lambda: not work.running and not work._rest.isActive())
