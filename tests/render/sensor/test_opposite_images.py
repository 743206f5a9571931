"""Noise of either sign and its opposite: as large as asked, by chance, the same in whatever parts it is drawn."""

from __future__ import annotations

import numpy as np
import pytest

from render.base.arrays import Float32
from render.sensor.opposite_images import opposite_images

SHAPE = 300, 200
FLOOR, SHARE, GAIN, BLACK = 9.0, 0.3, 0.5, 16.0


def images(seed: int, part: int = SHAPE[0], most: float = 4095.0) -> tuple[Float32, Float32, Float32]:
    """Mean electrons, and both images."""
    electrons = np.random.default_rng(0).uniform(0.0, 4000.0, SHAPE).astype(np.float32)
    one, other = np.empty_like(electrons), np.empty_like(electrons)
    for start in range(0, SHAPE[0], part):
        some = slice(start, start + part)
        opposite_images(electrons[some], start, (FLOOR, SHARE, seed), (GAIN, BLACK, most), (one[some], other[some]))
    return electrons, one, other


def test_both_images_are_as_far_from_the_light_as_a_share_of_its_noise() -> None:
    electrons, one, other = images(1)
    mean = GAIN * electrons + BLACK
    assert 0.5 * (one + other) == pytest.approx(mean, abs=1e-3)
    assert np.abs(one - mean) == pytest.approx(GAIN * SHARE * np.sqrt(electrons + FLOOR), abs=1e-3)


def test_signs_are_by_chance_along_and_across_scan_lines() -> None:
    electrons, one, _ = images(2)
    sign = np.sign(one - GAIN * electrons - BLACK)
    limit = 4.0 / np.sqrt(sign.size)
    assert abs(sign.mean()) < limit
    for shift in ((0, 1), (1, 0), (0, 64), (64, 0), (1, 1)):
        assert abs((sign * np.roll(sign, shift, (0, 1))).mean()) < limit
    other = np.sign(images(3)[1] - GAIN * electrons - BLACK)
    assert abs((sign * other).mean()) < limit


def test_scan_lines_have_their_noise_in_whatever_parts_they_are_drawn() -> None:
    whole, parts = images(4), images(4, part=7)
    assert all(np.array_equal(a, b) for a, b in zip(whole, parts, strict=True))


def test_nothing_is_brighter_than_the_sensor_tells() -> None:
    _, one, other = images(5, most=1000.0)
    assert max(one.max(), other.max()) == 1000.0
