"""How little light would make a peak: by the kernels as by whole images, and as the detection says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import correlate1d, median_filter

from analysis.line.detection.matched_filter import BLOCK, NOISE_GAIN, TAPS
from analysis.line.detection.noise import NoiseModel
from analysis.line.detection.rivals import AROUND, CERTAIN, NEAREST, rival_weights
from analysis.line.settings import ExtractionSettings

ROWS, WIDTH = 40, 8 * BLOCK + 4
NOISE = NoiseModel(gain=1.0, read_noise=3.0)
SPECKLED = NoiseModel(gain=1.0, read_noise=3.0, scintillation=((0.01,),))


def scene() -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Lines of many heights on an uneven ground, one of them missing, with a rival at 150."""
    random, x = np.random.default_rng(3), np.arange(WIDTH)
    u, height = random.uniform(20.0, 120.0, (ROWS, 1)), random.uniform(30.0, 3000.0, (ROWS, 1))
    light = 20.0 + 0.1 * x + height * np.exp(-0.5 * ((x - u) / 1.4) ** 2)
    light += random.uniform(0.0, 500.0, (ROWS, 1)) * np.exp(-0.5 * ((x - 150.0) / 1.5) ** 2)
    valid = np.ones((ROWS, 1), np.bool_)
    valid[7] = False
    return light.astype(np.float32), (u, np.full((ROWS, 1), 1.4), valid)


@pytest.mark.parametrize("noise", [NOISE, SPECKLED])
@pytest.mark.parametrize("select", ["strongest", "first"])
def test_weights_are_those_of_the_formula_by_whole_images(noise: NoiseModel, select: str) -> None:
    light, (u, width, valid) = scene()
    extraction = ExtractionSettings(select=select)
    response = correlate1d(light.astype(np.float64), TAPS, axis=1, mode="nearest")
    whole = WIDTH // BLOCK * BLOCK
    blocks = median_filter(response[:, :whole].reshape(ROWS, -1, BLOCK).mean(axis=2), (1, 7), mode="nearest")
    ground = blocks[:, np.minimum(np.arange(WIDTH) // BLOCK, blocks.shape[1] - 1)]
    margin = extraction.threshold * np.sqrt(NOISE_GAIN * np.maximum(ground + noise.floor, 1e-2))
    height, top = response - ground, np.zeros((ROWS, 1))
    if select == "strongest":
        top = np.where(valid, np.take_along_axis(height, np.rint(u).astype(int), axis=1), 0.0)
    away = np.abs(np.maximum(margin, top) - height)
    own = valid & (np.abs(np.arange(WIDTH) - u) <= AROUND * width)
    away = np.where(own, np.maximum(top - margin, margin), away)
    variance = NOISE_GAIN * (np.maximum(response, 0.0) + top + noise.floor)
    variance += noise.contrast**2 * (np.maximum(height, 0.0) ** 2 + top**2)
    nearest = NEAREST * extraction.threshold * np.sqrt(variance)
    expected = CERTAIN * TAPS.max() / np.maximum(away, nearest)
    found = rival_weights(light, (u, width, valid), noise, extraction)
    assert found.dtype == np.float32 and np.allclose(found, expected, rtol=2e-4)


def test_a_row_has_the_weights_that_it_has_alone() -> None:
    light, peaks = scene()
    found = rival_weights(light, peaks, SPECKLED, ExtractionSettings())
    for row in (0, 7, ROWS - 1):
        some = slice(row, row + 1)
        alone = rival_weights(light[some], tuple(part[some] for part in peaks), SPECKLED, ExtractionSettings())
        assert np.array_equal(alone[0], found[row])
