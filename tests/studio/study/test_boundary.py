"""A study finds the boundary of a map by the cells it asks for, and tells it as figure, table and words."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.study.boundary import Crossing
from render.base.errors import InputError
from studio.study.answers import answers
from studio.study.boundary_chart import outline
from studio.study.cells import Cell, Shard, next_cells, points
from studio.study.edges import Edge
from studio.study.estimate import estimate
from studio.study.page import write_page
from studio.study.study import Study

STUDY = Study.model_validate(
    {
        "base": "plane",
        "repeats": 4,
        "methods": ("likelihood", "phase"),
        "set": {"render.goal": None},
        "sweeps": [
            {
                "name": "map",
                "vary": [
                    {"field": "sensor.exposure_time", "low": 1e-4, "high": 1e-2, "count": 9, "spacing": "logarithmic"},
                    {"field": "sensor.read_noise", "low": 1.0, "high": 100.0, "count": 33, "spacing": "logarithmic"},
                ],
                "sampling": "boundary",
                "measure": "depth_rmse",
                "limit": {"measure": "depth_rmse", "value": 1e-4},
            }
        ],
    }
)
BASES = STUDY.bases(Path("."))


def edge(exposure: float) -> float:
    """Read noise at which the limit is crossed: above the window from 3.3 ms on."""
    return 3e4 * exposure


def measured(cells: Iterable[Cell]) -> dict[str, dict[str, Any]]:
    """An error in proportion to read noise over exposure, with a hundredth of scatter; phase does half as well."""
    rows = {}
    for cell in cells:
        exposure, noise = (float(value) for value in cell.point)  # type: ignore[arg-type]
        scatter = 1.0 + 0.01 * np.random.default_rng([cell.seed, int(1e6 * exposure)]).standard_normal()
        worse = 2.0 if cell.method == "phase" else 1.0
        rows[cell.key] = {"depth_rmse": 1e-4 * worse * scatter * noise / edge(exposure), "reason": ""}
    return rows


def run(shard: Shard) -> dict[str, dict[str, Any]]:
    rows: dict[str, dict[str, Any]] = {}
    while cells := next_cells(STUDY, BASES, rows, shard):
        rows |= measured(cells)
    return rows


def test_the_boundary_of_each_method_is_found_drawn_and_told(tmp_path: Path) -> None:
    rows = run(Shard())
    assert len(rows) <= len(points(STUDY.sweeps[0])) * 2 * 4 / 5
    page, (answer,) = write_page(tmp_path, STUDY, BASES, rows)
    assert len(answer.edges) == 2 and (tmp_path / "chart_1.png").stat().st_size > 5000
    table = list(csv.DictReader((tmp_path / "boundary_1.csv").open()))
    assert len(table) == 2 * 9
    for row in table:
        exact = edge(float(row["sensor.exposure_time"])) / (2.0 if row["method"] == "phase" else 1.0)
        assert row["ending"] == ("found" if exact < 100.0 else "holds")
        if row["ending"] == "found":
            assert float(row["low"]) <= exact * 1.02 and exact <= 1.02 * float(row["high"])
            assert abs(math.log(float(row["sensor.read_noise"]) / exact)) < 0.02
    words = page.read_text()
    assert "boundary in 7 of 9 columns; 2 keep it throughout" in words and "of the map&#39;s 297 cells" in words


def test_shards_take_a_methods_search_whole_and_together_give_the_same_rows() -> None:
    parts = [run(Shard(number, 2)) for number in (1, 2)]
    assert {**parts[0], **parts[1]} == run(Shard()) and not parts[0].keys() & parts[1].keys()


def test_what_is_known_so_far_is_told_and_an_estimate_is_of_what_it_will_take() -> None:
    first = next_cells(STUDY, BASES, {})
    answer = answers(STUDY, BASES, measured(first))[0]
    assert [len(one.crossings) for one in answer.edges] == [0, 0]
    assert 0 < estimate(STUDY, BASES, {}, {}).searched < 9 * 33 * 2 * 4 / 5


def test_a_boundary_without_limit_or_second_range_is_refused(tmp_path: Path) -> None:
    data = json.loads(STUDY.model_dump_json())
    (sweep,) = data["sweeps"]
    for change, words in (
        ({"limit": None}, "a limit"),
        ({"vary": sweep["vary"][:1]}, "two"),
        ({"vary": [sweep["vary"][0], {"field": "sensor.read_noise", "values": [1.0, 2.0]}]}, "low and high"),
    ):
        file = tmp_path / "study.json"
        file.write_text(json.dumps({**data, "sweeps": [{**sweep, **change}]}))
        with pytest.raises(InputError, match=words) as raised:
            Study.load(file)
        assert "sweeps[0]" in str(raised.value)


def test_the_boundary_is_drawn_where_columns_that_hold_meet_those_that_fail_and_not_along_the_frame() -> None:
    sweep, nothing = STUDY.sweeps[0], (math.nan, math.nan, math.nan)
    crossings = (
        Crossing(0, "fails", *nothing),
        Crossing(1, "found", 16.0, 15.0, 17.0),
        Crossing(2, "holds", *nothing),
        Crossing(3, "holds", *nothing),
        Crossing(4, "fails", *nothing),
    )
    across, along = outline(sweep, Edge("likelihood", crossings, 20))
    exposures = [1e-4 * 10.0 ** (k / 4.0) for k in (0, 1, 2, 3, 3, 4)]
    assert across == pytest.approx(exposures)
    # logarithmic, from 1 to 100 in 33 values: the 17th is 10
    assert along == pytest.approx([1.0, 10.0, 100.0, math.nan, 100.0, 1.0], nan_ok=True)
