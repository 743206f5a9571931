"""Labels of crowded places: apart from each other and from the places, within the picture, near where they belong."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.report.labels import label_places

LOW, HIGH = np.array([0.0, 0.0]), np.array([700.0, 300.0])
SIZES = np.tile([90.0, 18.0], (5, 1))


@pytest.mark.parametrize("crowd", [2.0, 20.0, 120.0])
@pytest.mark.parametrize("seed", range(4))
def test_no_label_lies_over_another_or_over_a_place(crowd: float, seed: int) -> None:
    places = np.array([350.0, 150.0]) + crowd * np.random.default_rng(seed).uniform(-1.0, 1.0, (5, 2))
    found = label_places(places, SIZES, LOW, HIGH)
    for i in range(5):
        assert np.all(np.abs(places - found[i]) < 0.5 * SIZES[i], axis=1).sum() == 0
        for k in range(i):
            assert np.any(np.abs(found[i] - found[k]) >= SIZES[i]), "two boxes of one size are apart along an axis"
    assert np.all(found - 0.5 * SIZES >= LOW) and np.all(found + 0.5 * SIZES <= HIGH)
    assert np.linalg.norm(found - places, axis=1).max() < 5.0 * np.linalg.norm(SIZES[0])


def test_in_a_corner_it_turns_inwards() -> None:
    (found,) = label_places(np.array([[3.0, 297.0]]), SIZES[:1], LOW, HIGH)
    assert found[0] > 45.0 and found[1] < 291.0


def test_where_there_is_no_room_it_is_still_placed() -> None:
    assert np.isfinite(label_places(np.zeros((3, 2)), SIZES[:3], LOW, LOW + 10.0)).all()
    assert label_places(np.zeros((0, 2)), np.zeros((0, 2)), LOW, HIGH).shape == (0, 2)
