"""The panels of the Study workspace on a small project."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtWidgets import QMenu
from pytestqt.qtbot import QtBot

from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.scene.inspector import Inspector
from studio.qt.study.charts_panel import ChartsPanel
from studio.qt.study.study_panel import StudyPanel
from studio.qt.study.study_work import StudyWork
from studio.runtime.workers import Engine

NOISE = ("sensor", "read_noise")
POWER = ("scene", "rig", "lasers", 0, "power")


class Desk:
    """The panels of the workspace on a small project, with an inspector beside them."""

    def __init__(self, folder: Path) -> None:
        project = Project.load(template_folder("plane"))
        least = {"ambient_samples": 1, "laser_error": 0.05, "transport": "direct", "goal": None}
        settings = project.render.model_copy(update=least)
        file = folder / "plane.json"
        project.model_copy(update={"render": settings}).save(file)
        self.session = Session(Document(Project.load(file), file))
        self.runner = JobRunner(self.session)
        self.panel, self.charts = StudyPanel(self.session, self.runner), ChartsPanel(self.session, self.runner)
        self.inspector = Inspector(self.session)
        self.work = one_of(StudyWork, self.session)
        self.session.vary_asked.connect(self.work.vary)
        self.work.engine = Engine(workers=1)

    def vary(self, item: tuple[Any, ...], *path: Any) -> None:
        """By the menu of a field of the inspector."""
        self.session.select(item)
        menu = QMenu()
        self.inspector.form.rows[(*item, *path)][0].fill_menu(menu)
        (action,) = menu.actions()
        action.trigger()

    def small(self, values: list[float]) -> None:
        """A study of as many cells as there are values."""
        if not self.work.sweep["vary"]:
            self.vary(NOISE[:1], NOISE[1])
        self.work.set_values(0, {"field": "sensor.read_noise", "values": values})
        self.work.change(lambda draft: draft.update(image_scale=0.05, repeats=1))

    def close(self) -> None:
        for panel in (self.panel, self.charts):
            panel.close()
        self.runner.close()
        live(self.session).close()


def run(qtbot: QtBot, desk: Desk) -> None:
    desk.work.start()
    qtbot.waitUntil(lambda: not desk.work.running)
