"""The usual ways find what exact views show, and lose depth to the joint adjustment where views are few."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from analysis.calibration.adjust import adjust
from analysis.calibration.depth import depth_off, working_volume
from analysis.calibration.estimate import Estimate, free_parameters, unit_plane
from analysis.calibration.observations import gather
from analysis.calibration.sequential import WAYS
from analysis.calibration.start import start
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of


@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize(("terms", "lasers"), [(0, 1), (5, 2)])
def test_exact_views_give_the_truth(name: str, terms: int, lasers: int) -> None:
    there = truth(3, 12, terms=terms, lasers=lasers)
    found = WAYS[name](views_of(there), target(), SIZE, terms, lasers)
    # OpenCV takes corners as float32, 1e-4 px at 2448 px
    np.testing.assert_allclose(found.intrinsics, there.intrinsics, atol=0.01)
    np.testing.assert_allclose(found.translation, there.translation, atol=1e-5)
    np.testing.assert_allclose(found.rotation, there.rotation, atol=1e-5)
    for m, exact in zip(found.planes, there.planes, strict=True):
        np.testing.assert_allclose(unit_plane(m), unit_plane(exact), atol=1e-5)


@pytest.mark.validation
def test_with_few_views_the_joint_adjustment_loses_less_depth() -> None:
    """It knows the camera better by the lines, and their plane by the poses' own errors."""
    off: dict[str, list[float]] = {"jointly": [], **{name: [] for name in WAYS}}
    for seed in range(24):
        there = truth(seed, 5, terms=5)
        views = noisy(views_of(there, corner_sigma=0.05, laser_sigma=0.05), np.random.default_rng(seed))
        volume = working_volume(there, 0, SIZE, 0.7, 1.0)
        guess = start(views, SIZE, 5, 1)
        found: dict[str, Estimate] = {name: way(views, target(), SIZE, 5, 1) for name, way in WAYS.items()}
        found["jointly"] = adjust(gather(views, target()), guess, free_parameters(guess, warp=False)).estimate
        for name, estimate in found.items():
            off[name].append(float(np.sqrt(np.mean(depth_off(estimate, there, volume) ** 2))))
    for name in WAYS:
        more = np.log(np.divide(off[name], off["jointly"]))
        assert stats.wilcoxon(more, alternative="greater").pvalue < 0.01, (name, np.exp(more))
