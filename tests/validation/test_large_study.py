"""A study of 10,000 cells opens in the memory of its rows, and leaves none behind."""

from __future__ import annotations

import gc
import time
import tracemalloc
from pathlib import Path

import pytest

from studio.study.cells import cells_at, points
from studio.study.folder_run import opened
from studio.study.measures import MEASURES
from studio.study.measuring import Row
from studio.study.store import Store
from studio.study.study import Study

pytestmark = pytest.mark.validation

CELLS = 10_000
PER_CELL = 5_000
"""Bytes at the most, of a row of 25 numbers with its key while it is read: 3,200 were found."""


def fill(folder: Path) -> None:
    """A map of 25 x 20 values by two methods, ten repeats each, with made-up numbers."""
    exposure = {"field": "sensor.exposure_time", "low": 1e-5, "high": 1e-2, "count": 25, "spacing": "logarithmic"}
    noise = {"field": "sensor.read_noise", "low": 1.0, "high": 50.0, "count": 20}
    study = Study.model_validate({
        "base": "plane", "repeats": 10, "methods": ["likelihood", "centre_of_mass"], "set": {"render.goal": None},
        "sweeps": [{"name": "map", "chart": "map", "vary": [exposure, noise]}],
    })  # fmt: skip
    bases = study.bases(folder)
    rows: list[Row] = [
        (cell.key, {**{name: 1e-4 + cell.repeat for name in MEASURES}, "reason": ""}, {"seconds_render": 1.0})
        for cell in cells_at(study, 0, bases, points(study.sweeps[0]))
    ]
    with Store(folder, study.digest(bases)) as store:
        store.describe(study, bases)
        store.add(rows)


def test_ten_thousand_cells_open_in_flat_memory(tmp_path: Path) -> None:
    fill(tmp_path)
    before = time.process_time()
    with Store(tmp_path, None) as store:
        assert len(store.rows()) == CELLS
    read = time.process_time()
    assert sum(spot.measure.count for spot in opened(tmp_path).answers[0].spots) == CELLS
    print(f"rows {read - before:.2f} s, with every interval {time.process_time() - read:.2f} s of processor time")
    tracemalloc.start()
    left = []
    for _ in range(3):
        opened(tmp_path)
        gc.collect()
        left.append(tracemalloc.get_traced_memory()[0])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(f"at most {peak / CELLS:.0f} bytes a cell, {left[2] - left[1]} more after another opening")
    assert peak < PER_CELL * CELLS
    assert abs(left[2] - left[1]) < 100 * 1024
