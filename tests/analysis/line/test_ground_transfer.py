"""What a background that is not level tells of the sensor."""

import numpy as np
import pytest

from analysis.line.ground_transfer import ground_transfer

SHAPE = (400, 256)


def photographed(level, gain, read_noise, seed=1):
    """(h, w) digital numbers, whole, of levels in electrons."""
    rng = np.random.default_rng(seed)
    electrons = rng.poisson(np.broadcast_to(level, SHAPE)) + rng.normal(0.0, read_noise, SHAPE)
    return np.round(gain * electrons)


@pytest.mark.parametrize(("gain", "read_noise"), [(0.1, 30.0), (0.5, 10.0), (2.0, 3.0)])
def test_a_slope_tells_gain_and_read_noise(gain, read_noise):
    told = ground_transfer(photographed(np.linspace(50.0, 4000.0, SHAPE[1]), gain, read_noise), 1.0)
    assert told is not None
    assert told[0] == pytest.approx(gain, rel=0.03)  # 16 variances of 6,000 steps each know it to 1 %
    assert told[1] == pytest.approx(read_noise, abs=0.2 * read_noise + 6.0)


def test_level_ground_tells_nothing():
    assert ground_transfer(photographed(200.0, 1.0, 3.0), 1.0) is None


def test_texture_is_not_taken_for_a_count():
    rng = np.random.default_rng(2)
    level = np.linspace(50.0, 4000.0, SHAPE[1])
    for contrast in (0.05, 0.2):
        textured = level * (1.0 + contrast * rng.normal(size=SHAPE))
        assert ground_transfer(photographed(np.maximum(textured, 0.0), 1.0, 3.0), 1.0) is None


def test_what_is_not_known_is_left_out():
    ground = photographed(np.linspace(50.0, 4000.0, SHAPE[1]), 1.0, 5.0)
    ground[:, 100:130] = np.nan
    ground[::3] = np.nan
    assert ground_transfer(ground, 1.0)[0] == pytest.approx(1.0, rel=0.04)
    assert ground_transfer(np.full(SHAPE, np.nan), 1.0) is None
