"""A new study of the window is at an image scale at which the line can be measured."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from analysis.report.total import NARROW_PX
from render.base.errors import InputError
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.study import first_scale as beside
from studio.qt.study.study_panel import StudyPanel
from studio.qt.study.study_work import StudyWork
from studio.study import small_images
from studio.study.draft import IMAGE_SCALE
from studio.study.kept_draft import kept_draft
from studio.study.line_seen import LineSeen
from studio.study.small_images import first_scale, small_image_doubts
from studio.study.study import Study

Panels = Callable[[], AbstractContextManager[StudyPanel]]


def test_it_is_the_first_at_which_the_line_is_not_said_to_be_too_thin() -> None:
    """A new study of the scan was at 0.25, where its line is 0.13 px wide."""
    base = Project.load(template_folder("scan"))

    def doubts(scale: float) -> str:
        sweep = {"name": "s", "vary": [{"field": "sensor.read_noise", "values": [1.0, 2.0]}]}
        study = Study.model_validate({"base": "scan", "image_scale": scale, "sweeps": [sweep]})
        return " ".join(small_image_doubts(study, {"scan": base}))

    assert first_scale(base) == 1.0
    assert ["too thin" in doubts(scale) for scale in (0.25, 0.5, 1.0)] == [True, True, False]


@pytest.mark.parametrize(
    ("width_of_one", "scale"),
    [(4.0 * NARROW_PX, 0.25), (2.0 * NARROW_PX, 0.5), (NARROW_PX, 1.0), (0.5 * NARROW_PX, 1.0), (None, IMAGE_SCALE)],
)
def test_by_the_width_of_the_line(width_of_one: float | None, scale: float, monkeypatch: pytest.MonkeyPatch) -> None:
    base = Project.load(template_folder("plane"))

    def seen(project: Project, laser: int) -> LineSeen:
        across = project.scene.camera.width / base.scene.camera.width
        return LineSeen(None if width_of_one is None else across * width_of_one, 0.0)

    monkeypatch.setattr(small_images, "line_seen", seen)
    assert first_scale(base) == scale


def test_a_project_without_a_preview_keeps_the_usual_one(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise InputError("there is no part")

    monkeypatch.setattr(small_images, "line_seen", none)
    assert first_scale(Project.load(template_folder("plane"))) == IMAGE_SCALE


@pytest.fixture
def shown(qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Panels:
    """Windows of the same plane, whose line wants half its image; one after the other."""
    monkeypatch.setattr(beside, "first_scale", lambda project, laser: 0.5)
    file = tmp_path / "plane.json"
    Project.load(template_folder("plane")).save(file)

    @contextmanager
    def show() -> Iterator[StudyPanel]:
        session = Session(Document(Project.load(file), file))
        runner = JobRunner(session)
        panel, work = StudyPanel(session, runner), one_of(StudyWork, session)
        qtbot.addWidget(panel)
        panel.show()
        qtbot.waitExposed(panel)
        qtbot.waitUntil(lambda: work.unseen.job(beside.LANE) is None)
        yield panel
        panel.close()
        runner.close()
        work.close()
        live(session).close()

    return show


def test_a_new_study_takes_it_and_is_not_kept_for_it(shown: Panels, tmp_path: Path) -> None:
    with shown() as panel:
        assert panel.work.draft["image_scale"] == panel.scale.value() == 0.5
        name = panel.work.base_name
    assert kept_draft(tmp_path / "plane.json", name) is None


def test_a_scale_of_ones_own_stays_and_the_next_new_study_has_it_again(shown: Panels, qtbot: QtBot) -> None:
    with shown() as panel:
        panel.work.change_sweep(vary=[{"field": "sensor.read_noise", "values": [1.0, 2.0]}])
        panel.scale.setValue(0.25)
    with shown() as panel:
        assert panel.scale.value() == 0.25, "as it was left"
        panel.work.start_anew()
        qtbot.waitUntil(lambda: panel.scale.value() == 0.5)


def test_a_ready_made_study_keeps_its_own(shown: Panels, qtbot: QtBot) -> None:
    with shown() as panel:
        panel.work.load("quick")
        qtbot.waitUntil(lambda: panel.work.unseen.job(beside.LANE) is None)
        assert panel.scale.value() == Study.load("quick")[0].image_scale == 0.5
