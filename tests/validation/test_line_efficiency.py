"""Line extraction over the whole grid of amplitude, width and read noise, against the Cramer-Rao bound."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.line.extract import extract
from analysis.line.result import Flag
from tests.analysis.line.line_images import cramer_rao, electrons, expected, exposed

pytestmark = pytest.mark.validation

AMPLITUDES = (100, 300, 1000, 3000, 10000)
SIGMAS = (0.4, 0.6, 0.8, 1.0, 1.5, 2.0, 3.0, 4.0)
READ_NOISES = (2, 5, 10)
ROWS = 16000


def cells():
    return [(a, s, r) for r in READ_NOISES for a in AMPLITUDES for s in SIGMAS if a / r >= 20]


def test_likelihood_efficiency_and_coverage_over_the_grid():
    """One good line in 100,000 is taken for two, 30 sigmas off and flagged: efficiency is that of the others."""
    rng = np.random.default_rng(2024)
    efficiency, coverage, failures, doubled = [], [], [], []
    for amplitude, sigma, read_noise in cells():
        centre = 100 + rng.uniform(-0.5, 0.5, ROWS)
        image = exposed(expected(200, centre, amplitude, sigma, 10.0), read_noise, rng).astype(np.float32)
        line = extract(image, method="likelihood", noise=electrons(read_noise))
        valid = line.valid[:, 0]
        error = (line.u[:, 0] - centre)[valid]
        plain = error[line.flag[valid, 0] != Flag.BLENDED]
        doubled.append(len(error) - len(plain))
        efficiency.append(cramer_rao(amplitude, sigma, read_noise, 10.0) ** 2 / np.mean(plain**2))
        coverage.append(np.mean(np.abs(error) < 2 * line.sigma_u[valid, 0]))
        failures.append(np.mean(~valid))
    print(f"\nefficiency: median {np.median(efficiency):.3f}, lowest {min(efficiency):.3f} of {len(efficiency)} cells")
    print(f"coverage of 2 sigma: {min(coverage):.3f} .. {max(coverage):.3f}; failed rows at most {max(failures):.4f}")
    assert np.median(efficiency) >= 0.97
    assert min(efficiency) >= 0.93
    assert min(coverage) >= 0.93
    assert max(coverage) <= 0.97
    assert max(failures) < 0.005
    assert sum(doubled) < 5e-5 * ROWS * len(doubled)


@pytest.mark.parametrize(("background", "read_noise"), [(0.0, 2.5), (10.0, 2.5), (100.0, 5.0), (2.0, 1.0)])
def test_false_rows_on_noise(background, read_noise):
    rng = np.random.default_rng(7)
    false = 0
    for _ in range(5):
        image = exposed(np.full((4000, 2448), background), read_noise, rng).astype(np.float32)
        false += int(extract(image, noise=electrons(read_noise)).valid.sum())
    print(f"\nfalse rows: {false} of 20000")
    assert false <= 20


CLAIMING = ("gaussian", "phase", "centre_of_mass", "gauss_3", "caruana", "guo", "steger")
"""Row by row; "likelihood" has its own test above, two-dimensional methods theirs in tests/analysis."""


@pytest.mark.parametrize("method", CLAIMING)
def test_every_method_that_claims_a_sigma_is_honest_over_the_grid(method):
    rng = np.random.default_rng(11)
    rows, covered, silent = 4000, [], 0
    for amplitude, sigma, read_noise in cells():
        centre = 100 + rng.uniform(-0.5, 0.5, rows)
        image = exposed(expected(200, centre, amplitude, sigma, 10.0), read_noise, rng).astype(np.float32)
        line = extract(image, method=method, noise=electrons(read_noise))
        claimed = np.isfinite(line.sigma_u[:, 0])
        if claimed.mean() < 0.9:  # it does not pretend where it cannot know; few rows by chance are no sample
            silent += 1
            continue
        error = np.abs(line.u[claimed, 0] - centre[claimed])
        covered.append((np.mean(error < 2 * line.sigma_u[claimed, 0]), amplitude, sigma, read_noise))
    share = np.array([cell[0] for cell in covered])
    told = f"{share.min():.3f} .. {share.max():.3f}, median {np.median(share):.3f} in {len(share)} cells"
    print(f"\n{method}: 2 sigma cover {told}, no sigma in {silent}; lowest {min(covered)}, highest {max(covered)}")
    chance = 3 * np.sqrt(0.95 * 0.05 / rows)
    assert share.min() > 0.93 - chance
    assert share.max() < 0.97 + chance
    assert 0.93 < np.median(share) < 0.97
