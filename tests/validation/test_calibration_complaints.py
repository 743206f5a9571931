"""Noisy views, judged as a calibration judges them: sets that cannot do are named, good ones are not blamed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from analysis.calibration.calibrate import DEFAULT_TERMS, Request, calibrate
from analysis.calibration.degenerate import complaints
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.motion import Kind, Told
from analysis.calibration.observations import gather
from analysis.calibration.odd_views import mirrored, refocused
from analysis.calibration.robust import adjust_robustly
from analysis.calibration.start import start
from analysis.calibration.virtual import noisy
from render.base.errors import InputError
from tests.analysis.calibration.boards import DEGENERATE, SIZE, degenerate, target, truth, views_of
from tests.analysis.calibration.test_motion import KINDS, PLACED, carried

pytestmark = pytest.mark.validation


def said(there: Estimate, seed: int) -> list[str]:
    """From the estimate with which the adjustment begins, or what is said where there is none."""
    views = noisy(views_of(there, laser_step=32), np.random.default_rng(1000 + seed))
    try:
        return complaints(views, start(views, SIZE, DEFAULT_TERMS, len(there.planes)), SIZE)
    except InputError as error:
        return [str(error)]


@pytest.mark.parametrize(("given", "sentence"), DEGENERATE)
def test_each_degenerate_set_is_named_by_its_estimate(given: dict[str, Any], sentence: str) -> None:
    silent = [seed for seed in range(20) if not any(sentence in one for one in said(degenerate(seed, **given), seed))]
    assert silent == []


def test_of_200_good_sets_none_is_blamed_by_its_estimate() -> None:
    blamed = {seed: found for seed in range(200) if (found := said(truth(seed, 12, terms=5), seed))}
    assert blamed == {}


def test_of_200_good_sets_no_view_is_called_mirrored_or_of_another_focus() -> None:
    extent, called = np.stack([target().min(axis=0), target().max(axis=0)]), {}
    for seed in range(200):
        there = truth(seed, 12, terms=5)
        views = noisy(views_of(there, laser_step=64), np.random.default_rng(2000 + seed))
        found = adjust_robustly(gather(views, extent), there, free_parameters(there, warp=True))
        if told := mirrored(views, found, extent, SIZE[0]) | refocused(found):
            called[seed] = told
    assert called == {}


@pytest.mark.parametrize("kind", KINDS)
def test_of_60_good_sets_of_carried_boards_no_view_is_called_of_another_focus(kind: Kind) -> None:
    called = {}
    for seed in range(60):
        there = carried(kind, views=14, seed=seed)
        by_name = {f"view {i}": (str(there.motion.group[i]), there.motion.given[i]) for i in range(2 * PLACED)}
        views = noisy(views_of(there, laser_step=64), np.random.default_rng(3000 + seed))
        views = [view for view in views if len(view.pixel) >= 8]  # some are carried out of the image
        if told := calibrate(views, target(), Request(SIZE, 1, 4, told=Told(kind, by_name))).adjusted.left_out:
            called[seed] = told
    assert called == {}
