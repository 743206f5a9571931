"""Noise that neighbouring pixels share, of a sensor that is not known: what the positions scatter, sigma tells."""

from __future__ import annotations

import math
from functools import partial

import cv2
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtr

from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from analysis.line.shared_noise import _covariance, shared_noise, with_shared_noise
from render.sensor.processing import compressed, demosaiced

ROWS, COLUMNS = 1024, 160
SIGMA = 2.5


def centres(rows: int = ROWS) -> np.ndarray:
    """Tilted and bent, so that it crosses pixels, mosaic and blocks."""
    y = np.arange(rows)
    return 60.0 + 0.031 * y + 4.0 * np.sin(y / 200.0)


def light(peak: float, background: float) -> np.ndarray:
    x = np.arange(COLUMNS) - centres()[:, None]
    area = peak * SIGMA * math.sqrt(2.0 * math.pi)
    return area * (ndtr((x + 0.5) / SIGMA) - ndtr((x - 0.5) / SIGMA)) + background


def counted(seed: int, gain: float = 0.05, peak: float = 2400.0) -> np.ndarray:
    """Numbers of 0 to 255: shot noise and read noise."""
    rng = np.random.default_rng(seed)
    return gain * (rng.poisson(light(peak, 400.0)) + rng.normal(0.0, 10.0, (ROWS, COLUMNS)))


def eight_bits(values: np.ndarray) -> np.ndarray:
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def blurred(values: np.ndarray, sigma: float) -> np.ndarray:
    return eight_bits(cv2.GaussianBlur(values, (0, 0), sigma))


def mosaicked(values: np.ndarray) -> np.ndarray:
    """A mono sensor's numbers, taken for a mosaic: grey light on filters that pass all of it, and green measured."""
    filled = demosaiced(np.clip(values / 255.0, 0.0, 1.0).astype(np.float32), "RGGB", "bilinear")
    return eight_bits(255.0 * filled[..., 1])


def coded(values: np.ndarray, quality: int) -> np.ndarray:
    return compressed(eight_bits(values), quality, "4:2:0")


def normalised(line, rows: int = ROWS) -> tuple[float, float]:
    """Robust standard deviation of error over sigma, and the share within two sigmas."""
    ratio = (line.u[:, 0] - centres(rows)) / line.sigma_u[:, 0]
    ratio = ratio[np.isfinite(ratio)]
    assert len(ratio) > 0.98 * rows
    return 1.4826 * float(np.median(np.abs(ratio))), float(np.mean(np.abs(ratio) < 2.0))


PROCESSES = {
    "blurred by 1 px": partial(blurred, sigma=1.0),
    "blurred by 2 px": partial(blurred, sigma=2.0),
    "demosaiced": mosaicked,
    "JPEG 90": partial(coded, quality=90),
}


@pytest.mark.parametrize("process", PROCESSES.values(), ids=PROCESSES.keys())
def test_sigma_holds_what_processing_makes_alike(process) -> None:
    line = extract(process(counted(1)), channel="mono")
    spread, within = normalised(line)
    print(f"\n{spread:.2f} {within:.3f} length {np.nanmedian(line.correlation_length):.1f}")
    assert 0.8 < spread < 1.3
    assert within > 0.9


def test_single_pixels_alone_would_not_know() -> None:
    image = blurred(counted(3), 1.0)
    alone = estimate_noise(image, ExtractionSettings()).model_copy(update={"alike": False})
    before, after = (normalised(line) for line in (extract(image, noise=alone), extract(image)))
    assert before[0] > 1.1 and abs(after[0] - 1.0) < 0.08
    # two standard errors below 95 %, of some 600 positions that err by themselves
    assert after[1] > 0.93 > before[1]


def test_the_correlation_length_is_that_of_a_blur() -> None:
    """Of white errors averaged over a Gaussian of s scan lines it is 2 sqrt(pi) s; cubics take some of it."""
    rng = np.random.default_rng(4)
    smooth = cv2.GaussianBlur(rng.normal(size=(4096, 1)), (0, 0), sigmaX=1e-3, sigmaY=3.0)[:, 0]
    smooth /= smooth.std()
    found = shared_noise(50.0 + 0.1 * smooth, np.full(4096, 0.05), np.full(4096, 2.0))
    assert found is not None
    # sigma is the same everywhere: how the excess is parted does not matter
    assert (1.0 + found.share) * 0.05**2 + found.variance == pytest.approx(0.1**2, rel=0.15)
    assert found.length == pytest.approx(2.0 * math.sqrt(math.pi) * 3.0, rel=0.2)


def test_what_does_not_grow_with_sigma_is_a_term_of_its_own() -> None:
    rng = np.random.default_rng(5)
    told = np.where(np.arange(8192) // 512 % 2, 0.02, 0.1)
    for share, added in ((0.0, 0.05), (3.0, 0.0)):
        true = np.sqrt((1.0 + share) * told**2 + added**2)
        found = shared_noise(true * rng.normal(size=8192), told, np.full(8192, 2.0))
        assert found is not None
        assert np.sqrt((1.0 + found.share) * told**2 + found.variance) == pytest.approx(true, rel=0.15)


def test_white_noise_is_left_as_it_is() -> None:
    """Three standard errors and a fifth of the variance: no more than one of a hundred lines is touched."""
    rng = np.random.default_rng(6)
    touched = 0
    for _ in range(100):
        u = centres() + 0.05 * rng.normal(size=ROWS)
        touched += shared_noise(u, np.full(ROWS, 0.05), np.full(ROWS, SIGMA)) is not None
    assert touched <= 1


def test_a_photograph_with_white_noise_keeps_its_sigma() -> None:
    image = eight_bits(counted(7))
    alone = estimate_noise(image, ExtractionSettings()).model_copy(update={"alike": False})
    np.testing.assert_array_equal(extract(image).sigma_u, extract(image, noise=alone).sigma_u)


def test_steps_and_corners_are_no_noise() -> None:
    rng = np.random.default_rng(8)
    y = np.arange(ROWS)
    u = 60.0 + 5.0 * (y // 100 % 2) + 0.4 * np.abs(y % 200 - 100.0) + 0.05 * rng.normal(size=ROWS)
    assert shared_noise(u, np.full(ROWS, 0.05), np.full(ROWS, SIGMA)) is None


def test_two_lines_whose_ranks_change_are_no_noise() -> None:
    rng = np.random.default_rng(9)
    u = 60.0 + 30.0 * rng.integers(0, 2, ROWS) + 0.05 * rng.normal(size=ROWS)
    assert shared_noise(u, np.full(ROWS, 0.05), np.full(ROWS, SIGMA)) is None


def test_a_rough_surface_is_told_by_a_sensor_of_independent_pixels() -> None:
    image = eight_bits(counted(11))
    assert not estimate_noise(image, ExtractionSettings()).alike
    assert estimate_noise(blurred(counted(11), 1.0), ExtractionSettings()).alike


@pytest.mark.parametrize("blur", [0.0, 0.8, 2.0])
def test_how_far_errors_are_alike_is_told_without_bias_and_to_a_few_tenths(blur: float) -> None:
    """Errors blurred along a line of 512 scan lines: the variance of a mean over many of them is c_0 times the length.

    A variance is known to sqrt(2 / n) by n that are independent, and so is a length by pairs of them: together by
    sqrt(6 / n), to which the choice of the lags adds.
    """
    n, kernel = 512, np.zeros(101)
    kernel[50] = 1.0
    kernel = gaussian_filter1d(kernel, blur) if blur else kernel
    length = kernel.sum() ** 2 / float(kernel @ kernel)
    told = []
    for seed in range(60):
        white = np.random.default_rng(seed).normal(size=n + 100)
        errors = np.convolve(white, kernel, "valid") / np.sqrt(kernel @ kernel)
        found = _covariance(50.0 + 0.03 * np.arange(n) + 0.05 * errors, np.full(n, 0.05), np.full(n, SIGMA))
        assert found is not None
        told.append(float(found.covariance[0]) * found.length / length)
    expected = math.sqrt(6.0 * length / n)
    assert np.std(told) < 2.0 * expected
    assert np.mean(told) == pytest.approx(1.0, abs=0.05 + 3.0 * np.std(told) / math.sqrt(60.0))


def test_scan_lines_that_err_more_and_say_so_make_the_others_err_no_more_alike() -> None:
    """Every third scan line errs by three times as much, independently: no distance has a covariance."""
    told = np.where(np.arange(ROWS) % 3 == 0, 0.15, 0.05)
    lengths = []
    for seed in range(20):
        u = centres() + told * np.random.default_rng(seed).normal(size=ROWS)
        found = _covariance(u, told, np.full(ROWS, SIGMA))
        assert found is not None and found.covariance[0] == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / ROWS))
        lengths.append(found.length)
    assert np.median(lengths) < 1.1


def test_too_few_scan_lines_say_nothing() -> None:
    rng = np.random.default_rng(10)
    assert shared_noise(rng.normal(size=96), np.full(96, 0.05), np.full(96, SIGMA)) is None


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_what_a_misfit_may_cost_at_most_becomes_what_it_costs_and_other_scan_lines_are_left(seed: int) -> None:
    """Every third scan line is no Gaussian, and is told 0.6 px by its fit: it scatters 0.15 px, the others as told."""
    rng = np.random.default_rng(seed)
    misfit = np.arange(ROWS) % 3 == 0
    flag = np.where(misfit, np.uint8(Flag.MISFIT), np.uint8(Flag.OK))[:, None]
    true, told = np.where(misfit, 0.15, 0.05)[:, None], np.where(misfit, 0.6, 0.05)[:, None]
    u = centres()[:, None] + true * rng.normal(size=(ROWS, 1))
    one = np.ones((ROWS, 1))
    found = with_shared_noise(Line("rows", "likelihood", u, told, SIGMA * one, one, one, one, flag))
    # a variance of 341 is known to 8 %: what is above 1 - 0.2 - 3 * 8 % = 0.65 of the one told is not surely less
    assert 0.15 * (1.0 - 3.0 * 0.04) < np.median(found.sigma_u[misfit]) < 0.15 / 0.65**0.5 * (1.0 + 3.0 * 0.04)
    assert np.median(found.sigma_u[~misfit]) == pytest.approx(0.05, rel=0.05)


def test_sigmas_that_are_as_the_scatter_says_are_left_to_the_bit() -> None:
    rng = np.random.default_rng(8)
    flag, one = np.full((ROWS, 1), np.uint8(Flag.MISFIT)), np.ones((ROWS, 1))
    u = centres()[:, None] + 0.1 * rng.normal(size=(ROWS, 1))
    line = Line("rows", "likelihood", u, 0.1 * one, SIGMA * one, one, one, one, flag)
    assert np.array_equal(with_shared_noise(line).sigma_u, line.sigma_u)
