"""What a study takes is told as it passes on this machine: the start of its workers, and how busy the machine is."""

from __future__ import annotations

from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from studio.runtime.workers import Engine
from studio.study import folder_run, runner, start_up
from studio.study.answers import answers
from studio.study.cells import next_cells
from studio.study.estimate import Estimate, estimate
from studio.study.page import columns
from studio.study.study import Study
from studio.study.tables import LOAD, task_seconds
from studio.study.tasks import tasks

SECONDS = {"seconds_render": 1.5, "seconds_develop": 0.2, "seconds_extract": 0.3}


@pytest.fixture
def kernels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(start_up, "kept_in", lambda: str(tmp_path / "kernels"))
    return tmp_path / "kernels"


def study_of(values: int) -> tuple[Study, dict[str, Any]]:
    """Each value takes a render of its own."""
    field = "scene.rig.lasers[0].T_rig_laser.translation[0]"
    sweep = {"name": "s", "vary": [{"field": field, "values": [0.1 + 0.01 * i for i in range(values)]}]}
    study = Study.model_validate({"base": "plane", "repeats": 1, "sweeps": [sweep]})
    return study, study.bases(Path())


def test_the_last_start_of_as_many_workers_foretells_the_next(kernels: Path) -> None:
    assert start_up.foretold(2) == start_up.USUAL
    start_up.remember(2, 45.0)
    start_up.remember(8, 70.0)
    start_up.remember(2, 44.0)
    assert (start_up.foretold(2), start_up.foretold(8), start_up.foretold(1)) == (44.0, 70.0, start_up.USUAL)
    for text in ("", "[]", '{"2": "long"}', '{"2": -1}', '{"2": 1e99}'):
        (kernels / start_up.FILE).write_text(text)
        assert start_up.foretold(2) == start_up.USUAL
    start_up.remember(2, 30.0)
    assert start_up.foretold(2) == 30.0


def test_a_start_that_cannot_be_written_down_is_forgotten(kernels: Path) -> None:
    kernels.write_text("a file where the folder should be")
    start_up.remember(2, 30.0)
    assert start_up.foretold(2) == start_up.USUAL


def test_a_run_remembers_how_long_its_workers_took_to_begin(
    kernels: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = SimpleNamespace(monotonic=lambda: 100.0)
    monkeypatch.setattr(folder_run, "time", clock)
    monkeypatch.setattr(runner, "run_study", lambda *_, begun, **__: begun(145.0))
    study, bases = study_of(2)
    heard: list[float] = []
    folder_run.run_into(tmp_path / "out", study, bases, engine=Engine(workers=2), started=heard.append)
    assert heard == [45.0] and start_up.foretold(2) == 45.0


def test_ten_cells_take_what_the_ten_before_took_on_this_machine() -> None:
    """2 s of a processor each, told as 10 s on two, of which a busy machine made 50 s."""
    study, bases = study_of(20)
    cells = next_cells(study, bases, {})
    idle = {cell.key: {"reason": "", **SECONDS} for cell in cells[:10]}
    busy = {key: {**row, LOAD: 5.0} for key, row in idle.items()}
    found = estimate(study, bases, idle, {})
    assert found.cells == 10 and found.wall(2) == pytest.approx(10.0)
    assert estimate(study, bases, busy, {}).wall(2) == pytest.approx(50.0)
    # renders that were there already took no time, and are no measure of those to come
    cached = {key: {**row, LOAD: 0.01} for key, row in idle.items()}
    assert estimate(study, bases, cached, {}).wall(2) == pytest.approx(10.0)


def test_the_start_of_the_workers_is_no_shorter_with_more_of_them() -> None:
    told = Estimate(10, 10, 0, 20.0, 0, start_up=45.0)
    assert (told.wall(1), told.wall(2), told.wall(10)) == (65.0, 55.0, 47.0)
    assert Estimate(10, 10, 0, None, 0, start_up=45.0).wall(2) is None


def test_a_row_has_the_load_of_the_machine_while_it_was_made(monkeypatch: pytest.MonkeyPatch) -> None:
    study, bases = study_of(1)
    (task,) = tasks(next_cells(study, bases, {}), 1.0, 0)
    both = [(f"cell {i}", {}, dict(SECONDS)) for i in range(2)]
    assert task_seconds([seconds for _, _, seconds in both]) == pytest.approx(1.5 + 2 * 0.5), "they share the render"
    monkeypatch.setattr("studio.study.measuring.measure_task", lambda task, cancelled: both)
    ticks = count(0.0, 12.5)
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: next(ticks)))
    seconds, rows = runner._measure(task, lambda: False)
    assert seconds == 12.5 and [row[2][LOAD] for row in rows] == [pytest.approx(5.0)] * 2
    monkeypatch.setattr("studio.study.measuring.measure_task", lambda task, cancelled: [("cell", {}, {})])
    assert runner._measure(task, lambda: False)[1] == [("cell", {}, {})], "nothing was measured"


def test_a_table_says_that_its_time_is_a_processors() -> None:
    study, bases = study_of(2)
    assert columns(answers(study, bases, {})[0])[3] == "processor time (s)"
