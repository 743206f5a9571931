"""A few false points decide neither colours nor axes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from analysis.height_map import HeightMap, within
from studio.scan.colour_scale import ColourScale
from studio.scan.deviation import Compared, Question
from studio.scan.first_range import deviation_limit, profile_range
from studio.scan.height_map import file_range, shown_range
from studio.scan.result_series import Series

RANDOM = np.random.default_rng(4)


def made(value: np.ndarray, lower: float | None, upper: float | None) -> Compared:
    found = SimpleNamespace(value=value)
    return cast(Compared, SimpleNamespace(found=found, question=Question(lower=lower, upper=upper)))


def series(index: np.ndarray, distance: np.ndarray) -> Series:
    return Series(index, index, index, 0.1 * index, distance)


def test_deviations_are_shown_about_as_far_as_is_allowed() -> None:
    value = np.concatenate([RANDOM.normal(0.0, 2e-6, 900), np.full(100, 2e-3)])
    assert deviation_limit(made(value, -5e-6, 1e-5)) == pytest.approx(2e-5)
    assert deviation_limit(made(value, None, 1e-5)) == pytest.approx(2e-5)
    assert 4e-6 < deviation_limit(made(value, None, None)) < 1e-5


def test_heights_are_those_of_the_part() -> None:
    heights = np.concatenate([np.linspace(0.0, 0.031, 900), np.full(100, -0.0695)])
    errors = np.concatenate([RANDOM.normal(0.0, 1e-5, 900), np.full(50, 0.07), np.full(50, np.nan)])
    made = HeightMap(heights[None], 0.0, 0.0, 1e-3, len(heights), 1e-5, 1e-5, 0.0)
    across = np.concatenate([np.arange(900.0), 9.0 * np.arange(100.0)])
    kept = within(made, file_range({"x": across, "y": 0.0 * across, "z": heights, "error_depth": errors}))
    assert shown_range(kept) == (0.0, 0.031) and kept.heights.shape == (1, 900)
    assert shown_range(made) == (-0.0695, 0.031)
    level = HeightMap(np.zeros((1, 4)), 0.0, 0.0, 1e-3, 4, 1e-5, 1e-5, 0.0)
    assert shown_range(level) is None


def test_the_bottom_of_a_groove_is_no_stray_although_its_points_err() -> None:
    """At -19.68 mm the map of a groove of 20 mm ended, and its profile had gaps."""
    across = np.tile(0.25e-3 * np.arange(-300.0, 301.0), 4)
    heights = np.minimum(np.abs(across) - 0.02, 0.0)
    errors = RANDOM.normal(0.0, 1e-5, len(across))
    errors[heights < -0.01968] = 4e-4
    cloud = {"x": across, "y": np.repeat(1e-3 * np.arange(4.0), 601), "z": heights, "error_depth": errors}
    assert file_range(cloud) == (-0.02, 0.0)
    strays = {12: -0.0215, 700: 0.0012, 900: -0.8, 901: -0.8, 902: -0.8}
    for i, height in strays.items():
        heights[i], errors[i] = height, np.nan
    assert file_range(cloud) == (-0.02, 0.0), "what is apart from the surface by a gap is stray"


def test_above_a_flat_part_a_gap_is_small() -> None:
    """A millimetre over a plate is far, however near that is to the plate's points beside it."""
    across = np.tile(0.25e-3 * np.arange(400.0), 4)
    heights = RANDOM.normal(0.0, 1e-5, len(across))
    errors = heights.copy()
    heights[50], errors[50] = 1e-3, np.nan
    ends = file_range({"x": across, "y": np.repeat(1e-3 * np.arange(4.0), 400), "z": heights, "error_depth": errors})
    assert ends is not None and ends[1] < 6e-5


def test_a_profile_is_as_large_as_the_true_one() -> None:
    index = np.arange(200.0)
    true = 294.0 + 15.0 * (index > 100)
    seen = true + RANDOM.normal(0.0, 0.01, 200)
    seen[::9] = 370.0
    ends = profile_range(series(index, true), [series(index, seen)])
    assert ends is not None
    assert ends[1] == pytest.approx((294.0 - 3.75, 309.0 + 3.75)) and ends[0] == pytest.approx((-4.975, 24.875))
    flat = profile_range(series(index, np.full(200, 300.0)), [series(index, seen - true + 300.0)])
    assert flat is not None and 299.8 < flat[1][0] < 299.97 and 300.03 < flat[1][1] < 300.2
    alone = profile_range(None, [series(index, true)])
    assert alone is not None and alone[1][0] < 294.0 and alone[1][1] > 309.0
    assert profile_range(None, []) is None


def test_a_person_has_another_say_than_the_first_limits() -> None:
    scale, values, first = ColourScale(), np.linspace(-50.0, 50.0, 101), (-7.0, 7.0)
    assert scale.limits(values, first) == first
    dragged = scale.dragged(first, True, 4.0)
    assert dragged.limits(values, first) == (-4.0, 4.0) and dragged.as_before().limits(values, first) == first
    assert scale.automatic(100.0).limits(values, first) == (-50.0, 50.0)
