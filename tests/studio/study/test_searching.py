"""A search goes on as soon as its cells are measured, and others fill the time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from studio.project.project import Project
from studio.study import measuring
from studio.study.runner import run_study
from studio.study.store import Store
from studio.study.study import Study
from tests.studio.study.test_run import DATA, HERE


def test_steps_of_a_search_do_not_wait_for_other_cells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    exposures: list[float] = []

    def measured(task: Any, cancelled: Any) -> list[Any]:
        rows = []
        for cell in task.cells:
            sensor = Project.from_text(cell.project).sensor
            exposures.append(sensor.exposure_time)
            rows.append((cell.key, {"completeness": float(sensor.exposure_time > 1e-5), "depth_rmse": 1.0}, {}))
        return rows

    monkeypatch.setattr(measuring, "measure_task", measured)
    monkeypatch.setattr(measuring, "warm_up", lambda project, methods: None)
    search, grid = DATA["sweeps"]
    grid = {**grid, "vary": [{"field": "render.ambient_samples", "values": [2, 3]}]}  # which shares no render with it
    chosen = Study.model_validate({**DATA, "sweeps": [search, grid]})
    bases = chosen.bases(tmp_path)
    told = []
    with Store(tmp_path, chosen.digest(bases)) as store:
        run_study(chosen, bases, store, engine=HERE, progress=lambda *cells: told.append(cells))
        assert store.count() == len(exposures) == told[-1][0] == told[-1][1]
    other = bases["plane"].sensor.exposure_time
    assert exposures[-12:] == 12 * [other] and other not in exposures[:-12]  # the grid's
    assert len(exposures) > 12 + 4 * 2 * 3
