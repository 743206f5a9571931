"""What no model of ours has, in the lens or in the board, is told; and good views raise no alarm.

python -m tests.validation.test_calibration_unmodelled 200    # a table, of as many seeds
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from analysis.calibration.checks import ALARM, halves, whiteness
from analysis.calibration.depth import working_volume
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import project
from analysis.calibration.observations import View, gather
from analysis.calibration.robust import adjust_robustly
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

pytestmark = pytest.mark.validation

SEEDS, VIEWS = 200, 20
Change = Callable[[Estimate, int, View], View]


def as_modelled(there: Estimate, number: int, view: View) -> View:
    return view


def bent_image(there: Estimate, number: int, view: View) -> View:
    """By 0.1 px at most, in a wave as long as the image is wide: no polynomial of the lens models is like it."""
    x = np.pi * (view.pixel - there.intrinsics[2:]) / there.intrinsics[2:]
    return replace(view, pixel=view.pixel + 0.1 * np.sin(x[:, ::-1]))


def bent_board(there: Estimate, number: int, view: View) -> View:
    """Like an S along its rows, 0.2 mm from its lowest to its highest: the board's two terms are both even."""
    x = view.target[:, 0] / np.abs(target()[:, 0]).max()
    height = 1e-4 * 1.5 * np.sqrt(3.0) * (x - x**3)
    place = np.column_stack([view.target, height]) @ there.rotation[number].T + there.translation[number]
    return replace(view, pixel=project(place[:, :2] / place[:, 2:], there.intrinsics, there.distortion)[0])


def told(change: Change, seed: int) -> bool:
    """Whether one of the checks speaks."""
    there = truth(seed, VIEWS, terms=5)
    views = [change(there, number, view) for number, view in enumerate(views_of(there, laser_step=128))]
    seen = gather(noisy(views, np.random.default_rng(10_000 + seed)), target())
    found = adjust_robustly(seen, there, free_parameters(there, warp=True))
    pair = halves(found, [working_volume(there, 0, SIZE, 0.7, 1.0)])
    return whiteness(found).p < ALARM or (pair is not None and pair.p < ALARM)


def share(change: Change, seeds: int) -> float:
    return float(np.mean([told(change, seed) for seed in range(seeds)]))


@pytest.mark.parametrize("change", [bent_image, bent_board])
def test_20_views_tell_of_a_lens_or_a_board_that_is_not_as_modelled(change: Change) -> None:
    assert share(change, SEEDS) >= 0.95


def test_good_views_raise_an_alarm_once_in_twenty_times_at_most() -> None:
    assert share(as_modelled, SEEDS) <= 0.05


if __name__ == "__main__":
    for each in (as_modelled, bent_image, bent_board):
        print(f"{each.__name__:12} told in {share(each, int(sys.argv[1])):.3f} of the seeds")
