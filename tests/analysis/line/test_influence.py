"""How far each pixel moves the line: in closed form, by differences, and by moving it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import erf

from analysis.line.detection.channel import scan_lines
from analysis.line.detection.noise import NoiseModel
from analysis.line.extract import extract
from analysis.line.influence import difference_influence, influence, likelihood_influence
from analysis.line.result import Flag
from analysis.line.settings import ExtractionSettings

NOISE = NoiseModel(gain=0.5, black_level=8.0, read_noise=5.0)
HEIGHT, SIGMA, GROUND, COLUMNS = 2000.0, 1.7, 40.0, 96


def image_of(places: np.ndarray, sigma: float = SIGMA) -> np.ndarray:
    """(n, COLUMNS) DN without noise: a line integrated over each pixel, at a place on each row."""
    x = np.arange(COLUMNS)[None] - places[:, None]
    g = sigma * np.sqrt(np.pi / 2) * (erf((x + 0.5) / sigma / np.sqrt(2)) - erf((x - 0.5) / sigma / np.sqrt(2)))
    return NOISE.gain * (HEIGHT * g + GROUND) + NOISE.black_level


PLACES = 47.0 + np.linspace(0.0, 1.0, 9)


def settings(method: str) -> ExtractionSettings:
    return ExtractionSettings(method=method)


def moved(image: np.ndarray, row: int, column: int, electrons: float, method: str) -> float:
    """px, of the line of a row, by a pixel that is brighter and darker by so many electrons."""
    found = []
    for sign in (1.0, -1.0):
        other = image.copy()
        other[row, column] += sign * electrons * NOISE.gain
        found.append(extract(other, settings=settings(method), noise=NOISE).u[row, 0])
    return float(found[0] - found[1]) / (2.0 * electrons)


@pytest.mark.parametrize("method", ["likelihood", "gaussian", "phase", "centre_of_mass"])
def test_a_pixel_moves_the_line_by_its_influence(method: str) -> None:
    image = image_of(PLACES)
    line = extract(image, settings=settings(method), noise=NOISE)
    found = influence(image, line, settings(method), NOISE)
    for row in (0, 2, 7):
        by_hand = np.array([moved(image, row, column, 20.0, method) for column in range(42, 54)])
        np.testing.assert_allclose(found[row, 42:54], by_hand, atol=0.02 * np.abs(by_hand).max())


def test_likelihood_in_closed_form_is_as_by_differences() -> None:
    image, chosen = image_of(PLACES), settings("likelihood")
    line = extract(image, settings=chosen, noise=NOISE)
    lines, rows = scan_lines(image, chosen, NOISE), np.arange(len(PLACES))
    first, closed = likelihood_influence(lines, line, chosen, rows, 0)
    other, differences = difference_influence(lines, line, chosen, rows, 0)
    start = int(first[0] - other[0])
    same = differences[:, start : start + closed.shape[1]]
    np.testing.assert_allclose(same, closed, atol=0.01 * closed.max())


@pytest.mark.parametrize("brightness", [0.2, 2.0])
def test_a_narrow_line_is_moved_as_by_differences(brightness: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose width its neighbours tell. Over the noise of its pixels, and a step below that of the brightest."""
    monkeypatch.setattr("analysis.line.influence.STEP", 0.001)
    background = NOISE.gain * GROUND + NOISE.black_level
    image = background + brightness * (image_of(47.0 + np.linspace(0.0, 3.3, 40), 0.28) - background)
    chosen = settings("likelihood")
    line = extract(image, settings=chosen, noise=NOISE)
    rows = np.flatnonzero(line.flag[:, 0] == Flag.UNRESOLVED)
    assert len(rows) >= 36
    first, differences = difference_influence(scan_lines(image, chosen, NOISE), line, chosen, rows, 0)
    columns = first[:, None] + np.arange(differences.shape[1])
    closed = np.take_along_axis(influence(image, line, chosen, NOISE)[rows], columns, axis=1)
    noise = np.sqrt((np.take_along_axis(image[rows], columns, 1) - NOISE.black_level) / NOISE.gain + NOISE.floor)
    apart, total = (np.sqrt(np.sum((part * noise) ** 2, axis=1)) for part in (closed - differences, differences))
    # the posterior that the differences move is itself a sum over a grid that follows it
    assert np.quantile(apart / total, 0.9) < 0.05 and np.median(apart / total) < 0.02


@pytest.mark.parametrize("sigma", [0.3, pytest.param(0.7, marks=pytest.mark.validation), SIGMA])
def test_all_pixels_that_the_fit_looks_at_have_influence(sigma: float) -> None:
    """A fit keeps the window of its seed, which is wider than a narrow line."""
    image, chosen = image_of(PLACES, sigma), settings("likelihood")
    line = extract(image, settings=chosen, noise=NOISE)
    found = influence(image, line, chosen, NOISE)
    for row in range(1, 8):
        by_hand = np.array([moved(image, row, column, 20.0, "likelihood") for column in range(32, 64)])
        assert np.abs(by_hand[found[row, 32:64] == 0.0]).max() < 0.01 * np.abs(by_hand).max()


def test_what_neighbours_tell_of_the_width_adds_the_variance_that_it_has_by_the_sensor() -> None:
    """As independent of the line's own pixels, and no less than these alone."""
    image, chosen = image_of(47.0 + np.linspace(0.0, 3.3, 40), 0.2), settings("likelihood")
    line = extract(image, settings=chosen, noise=NOISE)
    assert line.shared_u is not None
    rows = np.flatnonzero(line.shared_u[:, 0] > 0.1 * line.sigma_u[:, 0])
    assert len(rows) > 10
    variance = (image - NOISE.black_level) / NOISE.gain + NOISE.floor
    own, both = (influence(image, line, chosen, NOISE, shared=shared).astype(np.float64) for shared in (False, True))
    alone, more, total = (np.sum(part**2 * variance, axis=1)[rows] for part in (own, both - own, both))
    np.testing.assert_allclose(np.sqrt(more), line.shared_u[rows, 0], rtol=1e-4)
    assert (total >= alone + more - 1e-9).all()
    # light that is even moves neither place nor width
    even = np.abs(both.sum(axis=1))[rows] / np.abs(both).sum(axis=1)[rows]
    assert even.max() < 0.1


def test_its_sum_with_the_noise_of_the_pixels_is_the_sigma_that_is_told() -> None:
    image = image_of(PLACES)
    electrons = (image - NOISE.black_level) / NOISE.gain
    for method in ("likelihood", "phase"):
        line = extract(image, settings=settings(method), noise=NOISE)
        weight = influence(image, line, settings(method), NOISE).astype(np.float64)
        sigma = np.sqrt(np.sum(weight**2 * (electrons + NOISE.floor), axis=1))
        np.testing.assert_allclose(sigma, line.sigma_u[:, 0], rtol=0.03)


def test_more_light_everywhere_moves_nothing() -> None:
    image = image_of(PLACES)
    line = extract(image, settings=settings("likelihood"), noise=NOISE)
    weight = influence(image, line, settings("likelihood"), NOISE).astype(np.float64)
    assert np.abs(weight.sum(axis=1)).max() < 1e-3 * np.abs(weight).sum(axis=1).min()


def test_columns_are_as_rows_of_the_image_turned() -> None:
    image = image_of(PLACES)
    line = extract(image, settings=settings("likelihood"), noise=NOISE)
    turned = settings("likelihood").model_copy(update={"axis": "columns"})
    other = extract(image.T.copy(), settings=turned, noise=NOISE)
    rows = influence(image, line, settings("likelihood"), NOISE)
    np.testing.assert_array_equal(influence(image.T.copy(), other, turned, NOISE), rows.T)


def test_rows_that_were_not_tried_take_their_neighbours_influence() -> None:
    places = 47.0 + np.linspace(0.0, 3.0, 300)
    image = image_of(places)
    line = extract(image, settings=settings("phase"), noise=NOISE)
    found = influence(image, line, settings("phase"), NOISE)
    row = 151
    by_hand = np.array([moved(image, row, column, 20.0, "phase") for column in range(42, 58)])
    np.testing.assert_allclose(found[row, 42:58], by_hand, atol=0.1 * np.abs(by_hand).max())
