"""Colours that a mosaic fills in: which pixels were seen is found, and noise and lines are told by these alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from analysis.line.detection.filled_in import seen_pixels
from analysis.line.estimate import estimate_noise
from analysis.line.extract import extract
from analysis.line.influence import influence
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import expected, exposed
from tests.analysis.line.troubles import READ_NOISE, TROUBLES, coverage, filled_in, photographed, variance_of_means

ROWS, COLUMNS, SIGMA = 600, 120, 2.0
PLACES = [(0, 0), (0, 1), (1, 0), (1, 1)]


def raw(signal: float, slant: float, seed: int, sigma: float = SIGMA) -> tuple[np.ndarray, np.ndarray]:
    """Image (rows, columns) in electrons of a sensor without filters, and centres (rows,)."""
    centre = COLUMNS / 2 + slant * (np.arange(ROWS) - 0.5 * ROWS)
    mean = expected(COLUMNS, centre, signal, sigma, 10.0)
    return exposed(mean, READ_NOISE, np.random.default_rng(seed)), centre


def filled_from(image: np.ndarray, place: tuple[int, int]) -> np.ndarray:
    """As a mosaic that sees this place of its four fills it in."""
    y, x = place
    return filled_in(np.pad(image, ((y, 0), (x, 0)), "reflect"))[y:, x:]


def green(image: np.ndarray) -> np.ndarray:
    """As a mosaic that sees every other pixel fills it in."""
    even = np.add.outer(np.arange(len(image)), np.arange(image.shape[1])) % 2 == 0
    around = cv2.filter2D(image, -1, np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4.0)
    return np.where(even, image, around)


@pytest.mark.parametrize("step", [0.0, 1.0])
@pytest.mark.parametrize("place", PLACES)
def test_the_pixels_that_were_seen_are_found(place: tuple[int, int], step: float) -> None:
    image = filled_from(raw(1000.0, 0.0137, 1)[0], place)
    seen = seen_pixels(np.rint(image) if step else image, step)
    assert seen is not None
    assert np.argwhere(seen).tolist() == [list(place)]


def test_of_green_every_other_pixel_was_seen() -> None:
    seen = seen_pixels(green(raw(1000.0, 0.0137, 2)[0]), 0.0)
    assert seen is not None
    assert seen.tolist() == [[True, False], [False, True]]


@pytest.mark.parametrize("sigma", [0.3, 0.5, 1.0, 2.0])
def test_an_upright_line_is_no_mosaic(sigma: float) -> None:
    """In the middle of a pixel, where it bends in every other one, on ground with noise and without."""
    image, _ = raw(3000.0, 0.0, 3, sigma)
    still = expected(COLUMNS, np.full(ROWS, COLUMNS / 2.0), 3000.0, sigma, 10.0)
    narrow = slice(COLUMNS // 2 - 6, COLUMNS // 2 + 6)
    soft = cv2.GaussianBlur(image, (0, 0), 1)
    for part in (image, image[:, narrow], np.rint(still), np.rint(still)[:, narrow], soft):
        assert seen_pixels(part, 1.0) is None


@pytest.mark.parametrize("axis", ["rows", "columns"])
@pytest.mark.parametrize("signal", [1000.0, 10000.0])
@pytest.mark.parametrize("place", [(0, 0), (1, 1)])
def test_the_noise_is_that_of_the_sensor(place: tuple[int, int], signal: float, axis: Any) -> None:
    """What fits left over of pixels between those seen, made the gain up to 16 times too large."""
    image = filled_from(raw(signal, 0.0137, 4)[0], place).astype(np.float32)
    noise = estimate_noise(image if axis == "rows" else image.T, ExtractionSettings(axis=axis))
    assert noise.filled_in and noise.alike
    assert noise.gain == pytest.approx(1.0, abs=0.2)
    ground = noise.gain * (10.0 - noise.black_level) + (noise.gain * noise.read_noise) ** 2
    assert ground == pytest.approx(10.0 + READ_NOISE**2, rel=0.2)  # with a little of the line's wings


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("signal", [1000.0, 10000.0])
def test_sigma_holds_and_nothing_is_flagged(signal: float, known: bool) -> None:
    """A third to a half were flagged, a fifth not found, and sigma was told 1.5 to 6 times too large."""
    image, centre, noise = photographed(TROUBLES["mosaic"], signal, SIGMA, 1000, seed=5)
    line = extract(image, noise=noise if known else None)
    found = coverage(line, centre)
    print(f"\n{found} over 10 {variance_of_means(line, centre, 10):.2f}")
    assert found.lost == 0.0 and found.flagged < 0.01
    assert 0.62 < found.one < 0.74 and 0.92 < found.two < 0.98
    # that of every other scan line, which alone was seen, is twice that of the means between them
    assert np.median(line.sigma_u[::2]) == pytest.approx(np.sqrt(2.0) * np.median(line.sigma_u[1::2]), rel=0.05)
    assert np.median(line.amplitude[::2]) == pytest.approx(np.median(line.amplitude[1::2]), rel=0.01)


def test_green_is_measured_by_the_pixels_that_were_seen() -> None:
    image, centre = raw(3000.0, 0.05, 6)
    found = coverage(line := extract(green(image).astype(np.float32)), centre)
    assert found.flagged == 0.0
    assert 0.62 < found.one < 0.74 and 0.92 < found.two < 0.98
    assert np.median(line.sigma_u) == pytest.approx(found.rms, rel=0.1)


@pytest.mark.parametrize("known", [True, False])
def test_few_pixels_before_a_reflection_are_judged_too(known: bool) -> None:
    """Five were seen of each line, too few for two lines: all of them passed for Gaussian, off by three sigmas."""
    trouble = replace(TROUBLES["reflection of 10 %"], mosaic=True)
    image, _, noise = photographed(trouble, 3000.0, SIGMA, 500, seed=9)
    line = extract(image, noise=noise if known else None)
    assert np.mean(line.flag == Flag.OK) < 0.05


def test_a_line_narrower_than_the_pixels_seen_is_fitted_to_all() -> None:
    image, _ = raw(3000.0, 0.0137, 7, sigma=0.6)
    line = extract(filled_from(image, (0, 0)).astype(np.float32))
    assert np.mean(line.flag != Flag.OK) > 0.9


def test_influence_is_of_the_pixels_that_were_seen() -> None:
    """A line moves with all light under it."""
    image, centre, noise = photographed(TROUBLES["mosaic"], 3000.0, SIGMA, 400, seed=8)
    line = extract(image, noise=noise)
    moved = influence(image, line, ExtractionSettings(), noise)
    assert not moved[:, 1::2].any()
    shift = 0.01
    up, down = (expected(image.shape[1], centre + side * shift, 3000.0, SIGMA, 10.0) for side in (1.0, -1.0))
    with_it = np.sum(moved * (up - down), axis=1) / (2.0 * shift)
    np.testing.assert_allclose(with_it[1:-1], 1.0, rtol=0.05)  # the first and last are filled in from one side
