"""What a search asked for is its own, and what it has asked for is no longer to come."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio.study.cells import Shard, next_cells
from studio.study.estimate import estimate
from studio.study.folder_run import run_into
from studio.study.left_over import left_over
from studio.study.searching import Searching
from studio.study.study import Study
from studio.study.tables import SECONDS

Rows = dict[str, dict[str, Any]]


def study_of(repeats: int) -> Study:
    sweep = {
        "name": "starved",
        "vary": [{"field": "sensor.exposure_time", "low": 0.02, "high": 1e-5, "spacing": "logarithmic"}],
        "sampling": "bisection",
        "measure": "completeness",
        "limit": {"measure": "completeness", "value": 0.9, "above": False},
    }
    return Study.model_validate(
        {"base": "plane", "repeats": repeats, "methods": ["likelihood", "phase"], "sweeps": [sweep]}
    )


BASES = study_of(3).bases(Path())


def row(cell: Any) -> dict[str, Any]:
    """More of the line with more light, with a noise of each repeat: the search ends by values across its bracket."""
    noise = np.random.default_rng([cell.repeat, int(1e9 * cell.point[0])]).normal(scale=0.02)
    return {"completeness": 1.0 + 0.1 * math.log10(cell.point[0] / 1e-3) + noise, **dict.fromkeys(SECONDS, 1.0)}


def measured(study: Study, rows: Rows, steps: int = 100) -> Rows:
    for _ in range(steps):
        cells = next_cells(study, BASES, rows)
        rows = {**rows, **{cell.key: row(cell) for cell in cells}}
        if not cells:
            break
    return rows


def test_none_of_a_search_that_ended_is_left_over() -> None:
    rows = measured(study_of(3), {})
    assert len(rows) > 2 * 3 * 8 and left_over(study_of(3), BASES, rows) == 0
    assert left_over(study_of(3), BASES, {**rows, "of another value": {}}) == 1


def test_nor_are_cells_of_a_step_that_was_stopped_in_its_midst() -> None:
    """98 cells were said to be of values that nobody asks for: the search was not done with them."""
    rows = measured(study_of(3), {}, steps=4)
    cells = next_cells(study_of(3), BASES, rows)
    rows |= {cell.key: row(cell) for cell in cells if cell.repeat != 1}
    assert left_over(study_of(3), BASES, rows) == 0


@pytest.mark.parametrize("steps", [0, 1, 100])
def test_nor_what_a_search_of_fewer_repeats_asked_for(steps: int) -> None:
    rows = measured(study_of(8), measured(study_of(3), {}), steps)
    assert left_over(study_of(8), BASES, rows) == 0
    more = measured(study_of(4), {})
    assert left_over(study_of(3), BASES, more) >= len(more) / 4, "repeats that are taken away are"


def test_what_is_to_come_of_a_search_falls_as_it_goes_on() -> None:
    study, rows, told = study_of(3), Rows(), []
    while cells := next_cells(study, BASES, rows):
        found = estimate(study, BASES, rows, {})
        told.append(found.searched)
        assert Searching(study, BASES, Shard(), cells, rows).to_come == found.searched
        rows |= {cell.key: row(cell) for cell in cells}
    assert told[0] > told[1] > told[2] and told[-1] < told[0] / 2
    assert estimate(study, BASES, rows, {}).searched == 0


def test_a_search_under_way_tells_what_it_may_still_ask_for() -> None:
    study, rows = study_of(3), Rows({})
    search = Searching(study, BASES, Shard(), next_cells(study, BASES, rows), rows)
    told = [search.to_come]
    cells = next_cells(study, BASES, rows)
    while cells:
        rows.update({cell.key: row(cell) for cell in cells})
        cells = search.next_cells([cell.key for cell in cells], lambda: rows)
        told.append(search.to_come)
    assert all(later <= before for before, later in pairwise(told)) and told[-1] == 0


def test_the_share_that_is_done_counts_what_was_there_and_what_is_to_come(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After Go on the bar stood at a fifth where 683 of 936 were told, and the time left grew with the search."""

    def run(study: Study, bases: Any, store: Any, *, progress: Any, **_: Any) -> None:
        cell, other = next_cells(study, bases, {})[:2]
        if not store.count():
            store.add([(cell.key, row(cell), {})])
        progress(store.count(), 60, 40)
        store.add([(other.key, row(other), {})])
        progress(store.count(), 60, 40)
        progress(store.count(), 80, 0)

    monkeypatch.setattr("studio.study.runner.run_study", run)
    run_into(tmp_path, study_of(3), dict(BASES))
    shares: list[float] = []
    told: list[tuple[str, float]] = []
    run_into(tmp_path, study_of(3), dict(BASES), progress=lambda *heard: told.append(heard), there=shares.append)
    words, done = zip(*told[1:4], strict=True)
    assert shares == [0.02, 0.02, 0.025] and done == (0.02, 0.02, 0.025)
    assert words[0].startswith("2 of up to 100 cells") and words[2].startswith("2 of 80 cells")
