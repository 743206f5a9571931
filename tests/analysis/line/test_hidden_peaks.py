"""Narrow peaks on the flank of brighter light are candidates of the learned selection, and noise makes hardly any."""

from __future__ import annotations

import numpy as np

from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract

ROWS, COLUMNS, WIDTH = 300, 160, 1.2
NOISE = NoiseModel(gain=1.0, black_level=0.0, read_noise=3.0, saturation=60000.0)


def image(peak: float):
    """A glow of 8 px and 4,000 e-, on its flank a line of so many e-, in shot and read noise; and where the line is."""
    rng = np.random.default_rng(18)
    truth = 90.0 + 0.02 * np.arange(ROWS)
    columns = np.arange(COLUMNS)
    light = 4000.0 * np.exp(-0.5 * ((columns - 78.0) / 8.0) ** 2) + np.zeros((ROWS, 1))
    light += peak * np.exp(-0.5 * ((columns - truth[:, None]) / WIDTH) ** 2)
    return rng.poisson(light) + rng.normal(0.0, 3.0, light.shape), truth


def test_a_line_on_the_flank_of_a_glow_is_a_candidate():
    pixels, truth = image(900.0)
    seen = extract(pixels, select="learned", noise=NOISE).candidates
    assert seen is not None
    without = extract(pixels, peaks=5, noise=NOISE)

    assert not (np.abs(without.u - truth[:, None]) < 2.0).any()
    off = (seen.u - truth[:, None])[np.abs(seen.u - truth[:, None]) < 2.0]
    assert len(off) > 0.7 * ROWS
    # positions of 900 e- on this glow scatter by 0.06 px, their mean by 0.004: four of these
    assert np.abs(off).max() < 0.3
    assert abs(off.mean()) < 0.016


def test_noise_on_a_glow_makes_no_candidates():
    pixels, _ = image(0.0)
    seen = extract(pixels, select="learned", noise=NOISE).candidates
    assert seen is not None
    without = extract(pixels, peaks=5, noise=NOISE)
    assert seen.valid.sum() - without.valid.sum() <= 0.05 * ROWS
