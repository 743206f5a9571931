"""The deviation map: bands that follow the tolerance, and callouts at the places that deviate most."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex

from analysis.deviation import tells_no_place, unsure_of_place
from analysis.report.deviation_figure import BANDS, EVEN_BANDS, DeviationMap, draw, levels

UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize(("lower", "upper"), [(-5e-5, 5e-5), (0.0, 2e-4), (1e-4, 3e-4), (None, None)])
def test_edges_ascend_and_hold_the_tolerance_and_every_value(lower: float | None, upper: float | None) -> None:
    value = np.random.default_rng(1).normal(scale=1e-4, size=500)
    edges = levels(value, lower, upper)
    assert len(edges) == len(BANDS) + 1 and np.all(np.diff(edges) > 0.0)
    if lower is not None and upper is not None:
        assert lower in edges and upper in edges
        assert edges[0] <= value.min() and edges[-1] >= value.max()


def test_a_few_far_off_far_away_leave_the_bands_where_the_others_are() -> None:
    value = np.random.default_rng(1).normal(scale=1e-5, size=5000)
    value[:25] = -0.8
    edges = levels(value, -5e-5, 5e-5)
    assert edges[0] == pytest.approx(-1e-4, rel=0.01) and edges[-1] == pytest.approx(1e-4, rel=0.01)


@pytest.mark.parametrize("count", [0, 1, 7])
def test_far_off_points_beside_the_part_are_counted_and_a_dent_is_pointed_at(count: int) -> None:
    """A dent beyond six robust sigma is a place of the part, points hundreds of millimetres off it are none."""
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.1, 200), np.linspace(0.0, 0.03, 60)))
    random = np.random.default_rng(4)
    value = 5e-6 * random.standard_normal(len(x))
    value[np.hypot(x - 0.02, y - 0.015) < 0.01] = -3e-4
    stray = random.choice(len(x), count, replace=False)
    value[stray] = -np.linspace(0.1, 0.4, count)
    made = draw(DeviationMap(np.column_stack([x, y, value]), value, UP, -5e-5, 5e-5))
    assert [one.get_text() for one in made.axes[0].texts] == ["1: -300 µm"]
    told = {0: "", 1: ", 1 stray point has none", 7: ", 7 stray points have none"}[count]
    assert made.axes[0].get_title(loc="left").partition("\n")[2] == f"A number is the median of a place{told}"


def test_without_a_tolerance_nothing_is_drawn_as_within_it() -> None:
    x = np.linspace(0.0, 0.1, 50)
    points = np.column_stack([x, 0.3 * x, np.zeros(50)])
    for limits, bands in (((None, None), EVEN_BANDS), ((None, 1e-4), EVEN_BANDS), ((-1e-4, 1e-4), BANDS)):
        made = draw(DeviationMap(points, np.linspace(-9e-5, 9e-5, 50), UP, *limits))
        drawn = {to_hex(colour) for colour in np.atleast_2d(made.axes[0].collections[0].get_facecolor())}
        assert bands[4] in drawn and (BANDS[4] in drawn) == (bands is BANDS)


def test_points_far_off_leave_the_part_as_large_as_it_is_and_are_counted() -> None:
    """Two points half a metre off made a strip of a part of 100 mm."""
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.1, 100), np.linspace(0.0, 0.05, 50)))
    value = 5e-6 * np.random.default_rng(4).standard_normal(len(x))
    points = np.column_stack([x, y, value])
    value[:2], points[:2] = 0.5, (0.05, 0.7, 0.5)
    made = draw(DeviationMap(points, value, UP, -5e-5, 5e-5))
    low, high = made.axes[0].get_ylim()
    assert high - low < 70.0 and made.axes[0].get_xlim() == pytest.approx((-6.0, 106.0), abs=0.1)
    assert made.axes[0].get_title(loc="left").endswith("2 stray points have none,\n2 lie beyond the picture")


def test_an_end_of_the_part_that_is_bent_away_is_in_the_picture() -> None:
    """It is far off by its value, and a place of the part by its neighbours."""
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.1, 100), np.linspace(0.0, 0.03, 40)))
    value = 5e-6 * np.random.default_rng(4).standard_normal(len(x))
    value[x > 0.08] = -3e-4
    made = draw(DeviationMap(np.column_stack([x, y, value]), value, UP, -5e-5, 5e-5))
    left, right = made.axes[0].get_xlim()
    assert left < 0.0 and 100.0 < right < 110.0
    assert "beyond" not in made.axes[0].get_title(loc="left")


@pytest.mark.parametrize("kind", ["alone on their scan lines", "much less sure than most"])
def test_stray_points_beside_the_part_have_no_number_and_a_dent_beside_them_has(kind: str) -> None:
    """ "1: -3250 µm" stood in the report of a part against itself, over points that its last profile only grazes."""
    random, pitch, rows = np.random.default_rng(4), 5e-4, 60
    x, y = (one.ravel() for one in np.meshgrid(np.arange(20) * 5e-3, np.arange(rows) * pitch, indexing="ij"))
    scan_line = np.ravel(1000 * np.arange(20)[:, None] + np.arange(rows))
    value, sigma = 5e-6 * random.standard_normal(len(x)), np.full(len(x), 5e-6)
    dent = (np.abs(x - 0.03) < 7e-3) & (np.abs(y - 0.015) < 8e-3)
    value[dent] = -3e-4
    apart = np.arange(0, rows, 2) if kind.startswith("alone") else np.arange(20, 40)
    there = np.column_stack([x, y, value])
    stray = np.column_stack([np.full(len(apart), 0.1), apart * pitch, np.full(len(apart), -3.25e-3)])
    points, value = (
        np.concatenate([there, stray]),
        np.append(value, stray[:, 2] + 1e-5 * random.standard_normal(len(apart))),
    )
    scan_line = np.append(scan_line, 20_000 + apart)
    sigma = np.append(sigma, np.full(len(apart), 5e-6 if kind.startswith("alone") else 1e-3))
    unsure = unsure_of_place(points, value, scan_line, sigma, sigma)
    made = draw(DeviationMap(points, value, UP, -5e-5, 5e-5, tells_no_place(value, sigma, unsure)))
    assert [one.get_text() for one in made.axes[0].texts] == ["1: -300 µm"]
    title = made.axes[0].get_title(loc="left").partition("\n")[2]
    assert title == f"A number is the median of a place, {len(apart)} stray or unsure points have none"


@pytest.mark.parametrize("is_tall", [False, True])
def test_a_dent_and_a_bump_are_pointed_at_with_their_size(is_tall: bool) -> None:
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(0.0, 0.1, 200), np.linspace(0.0, 0.03, 60)))
    value = np.zeros(len(x))
    value[np.hypot(x - 0.02, y - 0.015) < 0.01] = -3e-4
    value[np.hypot(x - 0.08, y - 0.015) < 0.01] = 2e-4
    points = np.column_stack([y, x, 0.0 * x] if is_tall else [x, y, 0.0 * x])
    made = draw(DeviationMap(points, value, UP, -5e-5, 5e-5))
    texts = [one.get_text() for one in made.axes[0].texts]
    assert texts == ["1: -300 µm", "2: +200 µm"]
    # lying down, so that both maps are as wide as they can be
    width, height = (np.ptp(made.axes[0].collections[0].get_offsets()[:, k]) for k in range(2))
    assert width == pytest.approx(100.0, rel=1e-3) and height == pytest.approx(30.0, rel=1e-3)
