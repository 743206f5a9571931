"""The line in photographs of webcams and phones, by `main.py extract` as it stands, without an option."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

from render.frame import Frame, LaserCurve
from tests.validation.photograph_draws import place_of
from tests.validation.photograph_scenes import TROUBLES, Photograph, Place, _moved, judged, score

WHOLE, FALSE = 0.98, 0.001
LOW, HIGH = 0.92, 0.97


def line_of(count: int) -> Photograph:
    truth = np.stack([np.arange(count), 50.0 + 0.1 * np.arange(count)], axis=1)
    return Photograph(np.zeros((count, 100, 3), np.uint8), (truth,), "rows", "green", 2.0)


def test_the_score_tells_right_positions_from_false_ones_and_missing_ones() -> None:
    taken = line_of(100)
    rng = np.random.default_rng(3)
    truth = taken.truth[0]
    exact = np.column_stack([truth[:, 0], truth[:, 1] + 0.1 * rng.normal(size=100), np.full(100, 0.1)])
    told = {"axis": "rows", "colour": "green"}
    found = score(taken, told, exact)
    assert (found.found, found.false, found.colour) == (1.0, 0.0, "green")
    assert 0.88 <= found.within <= 1.0 and 0.7 < found.normalised < 1.3
    wrong = exact.copy()
    wrong[:10, 1] += 7.0
    assert score(taken, told, wrong).false == pytest.approx(0.1)
    assert score(taken, told, exact[:60]).found == pytest.approx(0.6)
    assert score(taken, {"axis": "columns"}, exact).found == 0.0


def test_a_moved_line_is_where_its_truth_is() -> None:
    centre, rows, x = 40.3 + 0.02 * np.arange(64), np.arange(64), np.arange(96)
    light = np.exp(-0.5 * ((x - centre[:, None]) / 2.0) ** 2).astype(np.float32)
    others = dict.fromkeys(field.name for field in fields(LaserCurve))
    curve = LaserCurve(**{**others, "index": rows, "position": centre})
    moved = _moved(Frame(0, (light,), ambient=None, curves=(curve,), truth=None), Place(3.25, -0.1))
    middle = (moved.laser(0) * x).sum(axis=1) / moved.laser(0).sum(axis=1)
    assert np.abs(middle - moved.curves[0].position).max() < 1e-4
    assert np.abs(moved.curves[0].position - centre - 3.25 + 0.1 * (rows - 32.0)).max() < 1e-12
    assert all(abs(place_of(seed).shift) <= 4.0 for seed in range(9)) and place_of(2).slope == 0.0


@pytest.mark.validation
@pytest.mark.parametrize("name", list(TROUBLES))
def test_the_line_is_found_where_it_is_by_colour_and_axis_of_its_own_choice(name: str, tmp_path) -> None:
    got = judged(name, tmp_path)
    print(f"\n{name}: {got}")
    assert got.axis == ("columns" if TROUBLES[name].level_line else "rows")
    assert got.colour in (None, TROUBLES[name].colour)
    assert got.found >= WHOLE
    assert got.false <= FALSE
    # some 300 to 600 scan lines, of which speckle and JPEG make neighbours err alike: a fifth count as their own
    chance = 3.0 * math.sqrt(0.05 * 0.95 / 100.0)
    assert LOW - chance <= got.within <= min(HIGH + chance, 1.0)
