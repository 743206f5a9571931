"""The width that narrow lines share: between the steps it is looked for at, and what its error does to means."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from analysis.line.detection.detect import PRIOR_WIDTHS
from analysis.line.extract import extract
from analysis.line.methods.shared_width import width_priors
from analysis.line.result import Flag, Line
from analysis.measures import means
from tests.analysis.line.line_images import electrons, expected, exposed

READ_NOISE, ROWS, IMAGES = 2.5, 300, 8


def narrow(sigma: float, signal: float, seed: int, step: float) -> tuple[Line, np.ndarray]:
    """A line that runs `step` px a scan line, and its errors."""
    rng = np.random.default_rng(seed)
    centre = 60.0 + rng.uniform(-0.5, 0.5) + step * np.arange(ROWS)
    mean = expected(121, centre, signal, sigma, 10.0)
    line = extract(exposed(mean, READ_NOISE, rng).astype(np.float32), noise=electrons(READ_NOISE))
    return line, line.u[:, 0] - centre


@pytest.mark.parametrize("sigma", [0.25, 0.3])
def test_the_shared_width_is_not_drawn_to_the_steps_that_it_is_looked_for_at(sigma):
    """Half-way between steps of 0.03 px all lines together were off by 0.01 px, and sure of it."""
    line, _ = narrow(sigma, 6000.0, seed=1, step=0.02)
    assert np.mean(line.width[line.valid]) == pytest.approx(sigma, abs=0.005)


@pytest.mark.parametrize("sigma", [0.25, 0.3])
def test_means_of_narrow_lines_do_not_scatter_more_than_told(sigma):
    """Over 10 scan lines the variance was 1.8 to 4 times what was told, over 100 up to 25 times."""
    found: dict[int, list[tuple[float, float]]] = {10: [], 100: []}
    for seed in range(IMAGES):
        line, error = narrow(sigma, 1000.0, seed, step=0.0013)
        at = np.flatnonzero(line.valid[:, 0])
        assert line.length_apart is not None and line.shared_u is not None
        told = (line.sigma_u[at, 0], line.length_apart[at, 0], line.shared_u[at, 0])
        for count, sums in found.items():
            seen, foretold = means(error[at], *told, np.zeros(len(at), np.bool_), at, np.zeros_like(at), count)
            sums.append((float(np.sum(seen**2)), float(np.sum(foretold**2))))
    for count, sums in found.items():
        seen, foretold = np.sum(sums, axis=0)
        # the width is the same all along an image: at least one degree of freedom for each
        most = chi2.ppf(0.999, IMAGES) / IMAGES
        assert 0.5 / most < seen / foretold < 1.15 * most, count


def test_the_correlation_length_holds_both_parts():
    """Of lines that share all of it: the triangle of windows of 65; of none: that which they have."""
    one = np.ones((ROWS, 1))
    line, _ = narrow(0.25, 1000.0, 1, 0.0)
    whole = Line("rows", "", one, one, one, one, one, one, line.flag, length_apart=2.0 * one, shared_u=one)
    assert whole.correlation_length is not None
    assert whole.correlation_length[150, 0] == pytest.approx(65.0)
    apart = Line("rows", "", one, one, one, one, one, one, line.flag, length_apart=2.0 * one, shared_u=0.0 * one)
    np.testing.assert_array_equal(apart.correlation_length, 2.0)
    half = Line(
        "rows", "", one, one, one, one, one, one, line.flag, length_apart=2.0 * one, shared_u=np.sqrt(0.5) * one
    )
    assert half.correlation_length is not None
    assert half.correlation_length[150, 0] == pytest.approx(0.5 * 2.0 + 0.5 * 65.0)


def test_what_is_beside_misfits_is_alike_on_all_scan_lines_that_are_looked_at():
    """Told by the triangle of a shared width, a mean over 100 that all have one neighbour was 1.4 times as far off."""
    one = np.ones((ROWS, 1))
    flag = np.full((ROWS, 1), Flag.BLENDED, np.uint8)
    line = Line("rows", "", one, one, one, one, one, one, flag, length_apart=one, shared_u=one)
    assert line.correlation_length is not None
    assert line.correlation_length[150, 0] == pytest.approx(2 * 64 + 1)
    flag[150:] = Flag.UNRESOLVED  # a narrow line beside them has the width in common, with the narrow ones
    weights = 1.0 - np.arange(65) / 65.0
    assert line.correlation_length is not None
    assert line.correlation_length[200, 0] == pytest.approx(2.0 * weights.sum() - 1.0)
    assert line.correlation_length[149, 0] == pytest.approx(65.0 + weights[1:].sum())


def told_of(width: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """(n, 2 m) what lines would tell of widths that their pixels show (n,) so well (n,), px."""
    log = -0.5 * ((PRIOR_WIDTHS - width[:, None]) / sigma[:, None]) ** 2
    return np.hstack((log, log))


def test_a_line_of_another_width_does_not_draw_that_of_its_neighbours():
    """Two lines that meet in a corner, as one of 0.25 px known to 0.03, drew 64 others by 0.02 px."""
    count = 60
    places, sigma = 50.0 + np.random.default_rng(5).uniform(size=count), np.full(count, 0.01)
    alone = width_priors(told_of(np.full(count, 0.15), np.full(count, 0.05)), places, sigma)
    width, known = np.full(count, 0.15), np.full(count, 0.05)
    width[30], known[30] = 0.3, 0.02
    beside = width_priors(told_of(width, known), places, sigma)
    assert alone is not None and beside is not None
    others = np.arange(count) != 30
    best = [PRIOR_WIDTHS[np.argmax(prior[0][others], axis=1)] for prior in (alone, beside)]
    np.testing.assert_array_equal(*best)
    assert not beside[0][30].any()  # it keeps its own


def test_lines_that_tell_nothing_share_nothing_that_is_not_finite():
    """Rounding put what lies between two equal numbers above both, and a root of it spoiled all neighbours."""
    rng = np.random.default_rng(6)
    told = np.repeat(-rng.uniform(size=(400, 1)), 2 * len(PRIOR_WIDTHS), axis=1)
    with np.errstate(invalid="raise"):
        found = width_priors(told, 50.0 + rng.uniform(size=400), np.full(400, 0.1))
    assert found is None or all(np.isfinite(one).all() for one in found)
