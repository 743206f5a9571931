"""A mean over neighbouring pixels that share their noise keeps more of it, by as much as the pixels themselves show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import correlate1d, gaussian_filter

from analysis.line.detection.channel import scan_lines
from analysis.line.detection.matched_filter import NOISE_GAIN, TAPS
from analysis.line.detection.noise import NoiseModel
from analysis.line.estimate import estimate_noise
from analysis.line.response_spread import response_spread
from analysis.line.settings import ExtractionSettings

SHAPE = (256, 640)
DARK = 6.0


def ground(blur: float, seed: int = 3) -> np.ndarray:
    """Noise of a standard deviation DARK on a level that slopes; blurred, as a camera that smooths it leaves it."""
    noise = np.random.default_rng(seed).normal(size=SHAPE)
    noise = gaussian_filter(noise, blur) if blur else noise
    return 200.0 + 0.1 * np.arange(SHAPE[1]) + DARK * noise / noise.std()


def spread_of(image: np.ndarray) -> float:
    # a black level above all of it: none of it is a count
    noise = NoiseModel(gain=1.0, black_level=1000.0, read_noise=DARK, step=0.0)
    return response_spread(scan_lines(image, ExtractionSettings(), noise))


@pytest.mark.parametrize("blur", [0.0, 0.7, 1.5, 3.0])
def test_the_spread_is_that_of_the_filters_response_over_that_of_white_noise(blur: float) -> None:
    pixels = np.zeros(129)
    pixels[64] = 1.0
    kernel = gaussian_filter(pixels, blur) if blur else pixels
    both = correlate1d(kernel, TAPS)
    expected = np.sqrt((both**2).sum() / (kernel**2).sum() / NOISE_GAIN)
    # the level, a median of seven blocks of 32 px, follows up to an eighth of noise that is alike over 10 px
    assert 0.875 * expected <= spread_of(ground(blur)) <= max(1.02 * expected, 1.0)


def test_what_goes_slower_than_the_level_is_no_noise() -> None:
    assert spread_of(ground(60.0)) == 1.0


def test_a_line_and_an_edge_on_a_quarter_of_the_scan_lines_are_no_noise() -> None:
    image = ground(0.0)
    image[64:128, 200:400] += 300.0
    image += 400.0 * np.exp(-0.5 * ((np.arange(SHAPE[1]) - 300.0) / 2.0) ** 2)
    assert spread_of(image) == pytest.approx(1.0, abs=0.1)


def test_a_processed_image_is_told_its_spread_and_one_of_white_noise_is_not() -> None:
    rng = np.random.default_rng(4)
    x = np.arange(SHAPE[1]) - 300.0 - 0.1 * np.arange(SHAPE[0])[:, None]
    raw = 60.0 + 100.0 * np.exp(-0.5 * (x / 2.0) ** 2) + 6.0 * rng.normal(size=SHAPE)
    smooth = gaussian_filter(raw, 1.5)
    white, alike = (
        estimate_noise(np.clip(np.rint(one), 0, 255).astype(np.uint8), ExtractionSettings()) for one in (raw, smooth)
    )
    assert white.spread == 1.0 and not white.alike
    assert alike.alike and alike.spread > 1.5
