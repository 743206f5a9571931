"""Two-dimensional methods on slanted lines: sigma, and what neighbouring rows have in common."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analysis.line.extract import extract
from tests.analysis.line.line_images import electrons, expected, exposed

ROWS, HEIGHTS = 600, 5


def errors(method: str, degrees: float, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Error, sigma and correlation length (6, ROWS) of straight lines whose normal is turned out of the rows."""
    slope, found = math.tan(math.radians(degrees)), []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        centre = 40 + np.arange(ROWS) * slope + rng.uniform(-0.5, 0.5)
        width = int(100 + ROWS * slope)
        heights = (np.arange(HEIGHTS) + 0.5) / HEIGHTS - 0.5
        light = sum(
            expected(width, centre + h * slope, 3000.0, sigma / math.cos(math.radians(degrees)), 0.0) for h in heights
        )
        image = exposed(light / HEIGHTS + 10.0, 3.0, rng).astype(np.float32)
        line = extract(image, method=method, noise=electrons(3.0))
        assert line.correlation_length is not None
        found.append((line.u[:, 0] - centre, line.sigma_u[:, 0], line.correlation_length[:, 0]))
    return tuple(np.array(part) for part in zip(*found, strict=True))


@pytest.mark.parametrize("sigma", [0.8, 1.5])
@pytest.mark.parametrize("degrees", [0, 20, 45, 60])
@pytest.mark.parametrize("method", ["steger_2d", "centre_of_mass_normal"])
def test_sigma_holds_on_a_slanted_line(method, degrees, sigma):
    error, told, length = errors(method, degrees, sigma)
    seen = np.isfinite(error)
    rows = seen.sum() / np.median(length[seen])  # as many as err on their own
    chance = 3 * math.sqrt(0.95 * 0.05 / rows)
    assert 0.93 - chance < np.mean(np.abs(error[seen]) < 2 * told[seen]) < 0.97 + chance


def test_rows_by_a_ridge_filter_are_as_alike_as_its_length_along_the_line():
    error, told, length = errors("steger_2d", 0, 1.5)
    seen = slice(20, ROWS - 20)  # away from the rows whose filter reaches over the edge
    means = error[:, seen].reshape(-1, 112).mean(axis=1)
    foretold = np.mean((told**2 * length)[:, seen]) / 112
    assert np.mean(means**2) == pytest.approx(foretold, rel=0.15 + 3 * math.sqrt(2 / len(means)))


def test_the_centre_of_mass_along_the_normal_is_free_of_the_grid_of_pixels():
    error, told, _ = errors("centre_of_mass_normal", 20, 1.5)
    # bilinear samples alone err by 0.015 px from one fraction of a pixel to another
    assert np.nanstd(error) < math.hypot(np.nanmedian(told), 0.005)
