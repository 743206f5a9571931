"""What a study takes is told before it runs, and not beside what is left of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pytestqt.qtbot import QtBot

from render.scene.motion import LinearStage
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder
from studio.qt.core.jobs import JobRunner
from studio.qt.core.live_preview import live
from studio.qt.core.session import Session, one_of
from studio.qt.study.study_panel import StudyPanel, estimate_text
from studio.qt.study.study_work import StudyWork
from studio.runtime.jobs import Job
from studio.study.estimate import NOISE_APART, Estimate, estimate
from studio.study.study import Study
from tests.studio.qt.shell.window_hands import until_cancelled


@pytest.fixture
def panel(qtbot: QtBot, tmp_path: Path) -> Iterator[StudyPanel]:
    """Of the plane, with three values of one field."""
    file = tmp_path / "plane.json"
    Project.load(template_folder("plane")).save(file)
    session = Session(Document(Project.load(file), file))
    runner = JobRunner(session)
    made, work = StudyPanel(session, runner), one_of(StudyWork, session)
    qtbot.addWidget(made)
    made.show()
    qtbot.waitExposed(made)
    work.change_sweep(vary=[{"field": "sensor.read_noise", "values": [1.0, 2.0, 3.0]}])
    qtbot.waitUntil(lambda: work.estimate is not None and not work.unseen.busy)
    yield made
    made.close()
    runner.close()
    work.close()
    live(session).close()


def test_of_a_motion_it_says_that_one_step_is_measured(panel: StudyPanel, qtbot: QtBot) -> None:
    assert panel.told.isVisible() and "step" not in panel.told.text()
    panel.session.set(("scene", "motion"), LinearStage(steps=20))
    qtbot.waitUntil(lambda: "step 1 of 20 alone" in panel.told.text())


def test_before_a_cell_was_timed_it_says_so_and_what_tells(panel: StudyPanel) -> None:
    assert panel.time.isVisible() and f"not timed yet ({panel.time.text()} measures" in panel.told.text()
    timed = estimate_text(Estimate(12, 3, 0, 60.0, 1_000_000), 2)
    assert "about 30 s on 2 processors" in timed and "not timed" not in timed
    assert "not timed" not in estimate_text(Estimate(0, 0, 0, None, 1_000_000), 2), "nothing is to come"


def test_while_it_runs_only_what_is_left_is_told(
    panel: StudyPanel, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(*_: object, progress: object, cancelled: object, **__: object) -> None:
        until_cancelled(progress, cancelled)  # type: ignore[arg-type]

    monkeypatch.setattr("studio.qt.study.study_work.run_into", run)
    work = panel.work
    (tmp_path / "results").mkdir()
    work.choose_folder(tmp_path / "results")
    qtbot.waitUntil(lambda: panel.foot.run.isEnabled())
    assert panel.told.isVisible() and "cells of" in panel.told.text()
    work.start()
    assert work.running and panel.told.isHidden() and panel.time.isHidden()
    said: list[str] = []
    panel.session.message.connect(lambda _, text: said.append(text))
    work.stop()
    qtbot.waitUntil(lambda: not work.running and panel.told.isVisible())
    assert panel.foot.run.text() == "Run" and "no cell was done, and Run begins it again" in said[-1]


def test_an_estimate_that_is_passed_before_a_cell_is_done_is_said_to_be(panel: StudyPanel) -> None:
    job: Job[object] = Job("study", lambda progress, cancelled: None)
    job.stage, job._seconds = "0 of 12 cells", 85.0
    panel.foot.tell_progress(job, promised=41.0)
    assert "longer than the 41 s that were estimated" in panel.foot.stage.text()
    panel.foot.tell_progress(job, promised=100.0)
    assert "longer" not in panel.foot.stage.text()


def test_what_a_small_image_makes_of_the_figures_is_told_before_it_runs(panel: StudyPanel, qtbot: QtBot) -> None:
    def at(scale: float) -> str:
        panel.work.change(lambda draft: draft.update(image_scale=scale))
        qtbot.waitUntil(lambda: panel.work.study().image_scale == scale and not panel.work._rest.isActive())
        qtbot.waitUntil(lambda: not panel.work.unseen.busy)
        return panel.told.text()

    assert "each pixel is 4 times as large" in at(0.25) and "not the scanner's" in panel.told.text()
    assert "too thin for its methods" not in at(1.0) and "not the scanner's" not in panel.told.text()
    assert "px wide there (sigma), too thin for its methods" in at(0.05)


def test_why_methods_do_not_share_a_render_is_told(panel: StudyPanel, qtbot: QtBot) -> None:
    def with_fixed(field: str, value: float | None) -> str:
        panel.work.change_sweep(methods=["likelihood", "phase"])
        panel.work.change(lambda draft: draft.update(set={field: value}))
        qtbot.waitUntil(lambda: not panel.work._rest.isActive() and not panel.work.unseen.busy)
        return panel.told.text()

    assert "Each method has renders of its own" in with_fixed("render.goal.depth", 0.2)
    assert "renders of its own" not in with_fixed("render.goal", None)


def test_why_exposures_and_powers_do_not_share_a_render_is_told_where_it_is_so() -> None:
    """15 cells of 15 renders were told of laser power by exposure, which both change without rendering anew."""
    power, exposure = "scene.rig.lasers[0].power", "sensor.exposure_time"
    moved = "scene.rig.lasers[0].T_rig_laser.translation[0]"

    def told_of(fields: tuple[str, ...], fixed: dict[str, Any]) -> Estimate:
        vary = [{"field": field, "values": [0.001, 0.002, 0.003]} for field in fields]
        made = {"base": "plane", "repeats": 2, "set": fixed, "sweeps": [{"name": "s", "vary": vary}]}
        study = Study.model_validate(made)
        return estimate(study, study.bases(Path()), {}, {})

    apart, shared = (
        told_of((power, exposure), {"render.goal.depth": 0.1}),
        told_of((power, exposure), {"render.goal": None}),
    )
    assert (apart.cells, apart.renders) == (18, 18) and NOISE_APART in apart.doubts
    assert (shared.cells, shared.renders) == (18, 2) and NOISE_APART not in shared.doubts
    other_light = told_of((moved,), {"render.goal.depth": 0.1})
    assert other_light.renders == 6 and NOISE_APART not in other_light.doubts


def test_measured_cells_that_drop_out_are_told_beside_those_to_come() -> None:
    told = estimate_text(Estimate(12, 3, 0, 60.0, 1_000_000, left_over=8), 2)
    first, second = told.split("\n")
    assert first.startswith("12 cells of 3 renders to go, about ")
    assert second == "8 measured cells are of values that are no longer asked for (they stay in the folder)."
    assert "1 measured cell is of values" in estimate_text(Estimate(0, 0, 0, 0.0, 0, left_over=1), 2)
    assert estimate_text(Estimate(0, 0, 0, 0.0, 0), 2) == "Every cell is measured."


def test_the_start_of_the_workers_is_told_with_the_time(panel: StudyPanel, qtbot: QtBot, monkeypatch: Any) -> None:
    """10 s were told of ten cells whose workers alone took 45 s to start."""
    told = estimate_text(Estimate(10, 10, 0, 20.0, 0, start_up=45.0), 2)
    assert told == "10 cells of 10 renders to go, about 55 s on 2 processors (45 s of it until they start), 0.0 MB"
    assert "until they start" not in estimate_text(Estimate(10, 10, 0, 20.0, 0), 2)
    monkeypatch.setattr("studio.qt.study.study_jobs.foretold", lambda workers: 7.0 + workers)
    panel.work.look_ahead()
    qtbot.waitUntil(lambda: panel.work.estimate is not None and panel.work.estimate.start_up > 0.0)
    assert panel.work.estimate is not None
    qtbot.waitUntil(
        lambda: panel.work.estimate is not None and panel.work.estimate.start_up == 7.0 + panel.work.processors
    )


def test_no_sentence_widens_the_panel(panel: StudyPanel, qtbot: QtBot) -> None:
    job: Job[object] = Job("study", lambda progress, cancelled: None)
    before = panel.minimumSizeHint().width()
    job.stage = "0 of 12 cells; the first ones are under way, or wait for their workers to start"
    panel.foot.show_state(Path("/a"), job, begun=False)
    panel.foot.tell_progress(job, promised=0.0)
    panel.problem.setText("the store cannot be read: /" + 200 * "x")
    panel.problem.show()
    qtbot.wait(50)  # a layout hears of it by an event
    assert panel.minimumSizeHint().width() == before


def test_the_open_project_has_its_new_name_as_soon_as_it_has_it(panel: StudyPanel) -> None:
    assert panel.session.set(("name",), "p1")
    assert panel.base.itemText(0) == "Open: p1"
