"""The lens has the terms that views prove, and none that noise alone makes seem to help."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens_choice import PROOF, _by_noise, choose_lens
from analysis.calibration.observations import gather
from analysis.calibration.virtual import exact_view, noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

EXTENT = target()
SLIGHT = {
    (-5e-4, 0.0, 0.0, 0.0): 0.4,
    (-8e-4, 1.6e-3, 0.0, 0.0): 0.8,
    (0.0, 0.0, 1.2e-4, -1.2e-4): 0.8,
    (-0.05, 0.1, 3e-4, -3e-4, -1.0): 0.95,
}
"""Lenses whose depth error is up to five times as large, at 20 views, without the terms that they need, and the share
of scanners for which these are found at least: of 24 each they were in 14, 22, 22 and 24.
"""


def chosen(there: Estimate, seed: int) -> int:
    count = len(there.rotation)
    exact = [exact_view(f"view {i}", there, i, target(), SIZE, laser_step=256) for i in range(count)]
    return choose_lens(gather(noisy(exact, np.random.default_rng(seed)), EXTENT), there)[0]


def test_the_fewest_terms_that_do_are_chosen() -> None:
    there = replace(truth(6, 12), distortion=np.array([-0.1, 0.1, 0.0, 0.0]))
    there = replace(there, intrinsics=np.array([1800.0, 1800.0, 1223.5, 1023.5]))
    views = [exact_view(f"view {i}", there, i, target(), SIZE, laser_step=128) for i in range(12)]
    views = noisy(views, np.random.default_rng(7))
    terms, trials = choose_lens(gather(views, EXTENT), there)
    assert terms == 4
    assert trials[0].terms == 0 and trials[0].p < 1e-6
    # a pixel is z^2 / (f b) of depth, some 2 mm here, of which the line's noise is 0.05 and its median two thirds
    pixel = 0.85**2 / (1800.0 * 0.2)
    assert 0.3 * 0.05 * pixel < trials[1].depth < 1.5 * 0.05 * pixel < trials[0].depth
    views[3].stripes[0].pixel[:, 0] += 30.0
    assert choose_lens(gather(views, EXTENT), there)[0] == 4


@pytest.mark.parametrize("seeds", [1, pytest.param(12, marks=pytest.mark.validation)])
@pytest.mark.parametrize("lens", SLIGHT)
def test_slight_terms_that_depth_needs_are_found(lens: tuple[float, ...], seeds: int) -> None:
    found = [chosen(replace(truth(seed, 20), distortion=np.array(lens)), seed) for seed in range(1, 1 + seeds)]
    assert sum(terms >= len(lens) for terms in found) >= max(1, stats.binom.ppf(0.001, seeds, SLIGHT[lens]))


def test_a_lens_without_distortion_seldom_gets_terms() -> None:
    found = [chosen(truth(seed, 12), seed) for seed in range(2)]
    assert sum(terms > 0 for terms in found) <= 1  # both: once in 1 / PROOF^2


@pytest.mark.validation
def test_needless_terms_are_as_rare_as_is_told() -> None:
    found = [chosen(truth(seed, 12 + 8 * (seed % 2)), 100 + seed) for seed in range(60)]
    assert sum(terms > 0 for terms in found) <= stats.binom.ppf(0.999, 60, PROOF)


def test_a_term_that_few_views_show_is_proved_by_them() -> None:
    """What it takes off is no noise of the test, though it differs from view to view."""
    views = views_of(truth(0, 12), laser_step=256)
    seen, rng = gather(views, EXTENT), np.random.default_rng(0)
    larger = rng.normal(size=(len(seen.view), 2))
    shown = np.where(seen.view < 2, 0.5, 0.02)[:, None]  # of 117 corners each: 11 of its own sigmas in both
    assert _by_noise(seen, larger + shown, larger) < 1e-3
    assert _by_noise(seen, larger, larger + shown) > PROOF
