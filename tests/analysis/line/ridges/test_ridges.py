"""Ridges of any direction: rings, crossings and lines along the rows, with a closed form for what smoothing does."""

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.ridges.ridges import find_ridges
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import electrons, exposed

SIZE, SIGMA, AMPLITUDE = 260, 1.5, 2000.0


def drawn(distance, fine=4, size=SIZE):
    """Mean electrons of a Gaussian line at the zeros of distance(u, v), each pixel integrated."""
    steps = (np.arange(size * fine) + 0.5) / fine - 0.5
    u, v = np.meshgrid(steps, steps)
    light = np.exp(-0.5 * (distance(u, v) / SIGMA) ** 2)
    return AMPLITUDE * light.reshape(size, fine, size, fine).mean(axis=(1, 3)) + 10.0


def noisy(mean, seed=0):
    return exposed(mean, 3.0, np.random.default_rng(seed)).astype(np.float32)


def ring(u, v, radius=90.0):
    return np.hypot(u - 130.3, v - 129.6) - radius


@pytest.fixture(scope="module")
def on_ring():
    return find_ridges(noisy(drawn(ring)), noise=electrons(3.0))


def test_a_ring_is_one_line_found_all_around(on_ring):
    angle = np.arctan2(on_ring.v - 129.6, on_ring.u - 130.3)
    assert (np.histogram(angle, bins=72, range=(-np.pi, np.pi))[0] >= 5).all()
    assert np.bincount(on_ring.chain)[0] > 0.95 * 2 * np.pi * 90 * 0.8
    radial = np.column_stack((np.cos(angle), np.sin(angle)))
    assert np.abs((on_ring.normal * radial).sum(axis=1)).min() > 0.995
    step = np.hypot(np.diff(on_ring.u), np.diff(on_ring.v))[np.diff(on_ring.chain) == 0]
    assert step.max() < 3.0 and 0.6 < np.median(step) < 1.6


def test_smoothing_cuts_the_corner_of_an_arc_by_its_closed_form_and_sigma_is_honest(on_ring):
    error = ring(on_ring.u, on_ring.v)
    filter_sigma = 1.5 * SIGMA
    # towards the centre by sigma_f^2 / 2R (accuracy note, 3); pixels add a twelfth
    bias = -(filter_sigma**2 + 1 / 12) / (2 * 90.0)
    spread = on_ring.sigma_u.mean()
    independent = len(error) / (4 * filter_sigma)
    assert np.mean(error) == pytest.approx(bias, abs=4 * spread / np.sqrt(independent) + 0.003)
    z = (error - np.mean(error)) / on_ring.sigma_u
    assert np.std(z) == pytest.approx(1.0, abs=4 / np.sqrt(2 * independent))
    assert on_ring.width.mean() == pytest.approx(np.sqrt(SIGMA**2 + 1 / 12), rel=0.03)
    assert on_ring.amplitude.mean() == pytest.approx(AMPLITUDE, rel=0.05)


def test_lines_along_the_rows_and_across_each_other_are_found():
    both = drawn(lambda u, v: np.minimum(np.abs(v - 100.4), np.abs(u - 0.5 * v - 60.0) / np.hypot(1.0, 0.5)))
    found = find_ridges(noisy(both), noise=electrons(3.0))
    away = np.abs(found.u - 110.2) > 12
    level = away & (np.abs(found.normal[:, 1]) > 0.99)
    assert np.abs(found.v[level] - 100.4).max() < 0.1 and level.sum() > 200
    oblique = away & ~level
    off = (found.u - 0.5 * found.v - 60.0)[oblique] / np.hypot(1.0, 0.5)
    assert np.abs(off).max() < 0.15 and oblique.sum() > 180


def test_where_a_ridge_crosses_a_row_the_row_method_says_the_same():
    image = noisy(drawn(lambda u, v: (u - 0.3 * v - 80.0) / np.hypot(1.0, 0.3)))
    settings = ExtractionSettings(width=1.5)
    line = extract(image, method="steger_2d", settings=settings, noise=electrons(3.0))
    found = find_ridges(image, settings=settings, noise=electrons(3.0))
    inside = (found.v > 20) & (found.v < 240)
    rows = np.interp(found.v[inside], np.nonzero(line.valid[:, 0])[0], line.u[line.valid[:, 0], 0])
    off = (found.u[inside] - rows) * np.abs(found.normal[inside, 0])
    # rows are interpolated linearly between crossings that are half independent
    assert np.sqrt(np.mean(off**2)) < np.nanmean(found.sigma_u)


@pytest.mark.parametrize("background", [0.0, 10.0, 300.0])
def test_noise_holds_no_line(background):
    rng = np.random.default_rng(int(background))
    points = rows = 0
    for _ in range(6):
        image = exposed(np.full((700, 700), background), 3.0, rng).astype(np.float32)
        found = find_ridges(image, noise=electrons(3.0))
        points, rows = points + len(np.unique(np.round(found.v))), rows + 700
    assert points <= 0.001 * rows


def test_a_scan_axis_has_no_say():
    image = noisy(drawn(ring))
    rows = find_ridges(image, noise=electrons(3.0))
    columns = find_ridges(image, settings=ExtractionSettings(axis="columns"), noise=electrons(3.0))
    np.testing.assert_array_equal(rows.u, columns.u)
