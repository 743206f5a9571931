"""The gain of uneven ground, by its noise against its level."""

import numpy as np
import pytest

from analysis.line.ground_noise import ground_noise

ROWS, WIDTH = 256, 160


@pytest.mark.parametrize("gain", [0.1, 1.0, 4.0])
def test_a_slope_tells_gain_and_read_noise(gain):
    rng = np.random.default_rng(1)
    level = np.broadcast_to(np.linspace(50.0, 400.0, WIDTH), (ROWS, WIDTH))
    found = ground_noise(gain * (rng.poisson(level) + rng.normal(0.0, 5.0, level.shape)))
    assert found is not None
    # 2,500 blocks of some 9 independent squares, of which the slope uses what their levels differ
    assert found[0] == pytest.approx(gain, rel=0.06)
    assert found[1] == pytest.approx(25.0 * gain**2, abs=15.0 * gain**2)


def test_even_ground_tells_nothing_and_neither_does_a_texture_that_multiplies_the_light():
    rng = np.random.default_rng(2)
    assert ground_noise(rng.poisson(10.0, (ROWS, WIDTH)).astype(float)) is None
    level = np.linspace(50.0, 4000.0, WIDTH)
    assert ground_noise(level * rng.normal(1.0, 0.1, (ROWS, WIDTH))) is None


def test_too_few_pixels_tell_nothing():
    assert ground_noise(np.full((ROWS, WIDTH), np.nan)) is None
    assert ground_noise(np.ones((4, WIDTH))) is None
    assert ground_noise(np.ones((ROWS, 7))) is None


def test_pixels_without_noise_tell_nothing():
    assert ground_noise(np.full((ROWS, WIDTH), 3.0)) is None
