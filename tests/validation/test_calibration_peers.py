"""Our calibration beside others' of the same corners and lines: the true error of depth over the working volume.

python -m tests.validation.test_calibration_peers 20    # a table, of as many seeds
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.util import find_spec

import numpy as np
import pytest

from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.depth import working_volume
from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import normalise
from analysis.calibration.observations import View
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of
from tests.validation.calibration_peers import Found, by_mrcal, by_vision_calibration, has_mrcal

pytestmark = pytest.mark.validation

SEEDS, TERMS, NEAREST, FARTHEST, ROWS = 8, 5, 0.7, 1.0, 16


@dataclass(frozen=True)
class Case:
    """Views of a board that is bent by so much, m, and whether one line of them is that of a reflection."""

    views: int
    warp: float = 0.0
    stray: bool = False


CASES = {
    "38 views": Case(38),
    "20 views": Case(20),
    "10 views": Case(10),
    "5 views": Case(5),
    "12 views, board bent by 0.2 mm": Case(12, warp=2e-4),
    "12 views, one line a reflection": Case(12, stray=True),
}


def by_ours(views: Sequence[View]) -> Found:
    found = calibrate(views, target(), Request(SIZE, 1, TERMS, nearest=NEAREST, farthest=FARTHEST)).estimate
    return found.intrinsics, found.distortion, found.planes[0]


WAYS: dict[str, tuple[str, Callable[[Sequence[View]], Found]]] = {
    "mrcal, and a plane through the lines on its boards": ("mrcal", by_mrcal),
    "vision-calibration, least squares": ("vision_calibration", partial(by_vision_calibration, loss="squares")),
    "vision-calibration, Cauchy's loss": ("vision_calibration", partial(by_vision_calibration, loss="robust")),
    "vision-calibration, as it comes": ("vision_calibration", by_vision_calibration),
}
"""By name: the package, and how it calibrates."""


def is_here(package: str) -> bool:
    return has_mrcal() if package == "mrcal" else find_spec(package) is not None


def views_in(case: Case, seed: int) -> tuple[Estimate, list[View]]:
    there = truth(seed, case.views, terms=TERMS, warp=(case.warp, -0.5 * case.warp))
    views = noisy(views_of(there, laser_step=ROWS), np.random.default_rng(seed))
    if case.stray:
        number = max(range(len(views)), key=lambda i: len(views[i].stripes[0].pixel) if views[i].stripes else 0)
        stripe = views[number].stripes[0]
        moved = replace(stripe, pixel=stripe.pixel + np.array([6.0, 0.0]))
        views[number] = replace(views[number], stripes=(moved,))
    return there, views


def depth_error(there: Estimate, found: Found) -> float:
    """m^2, mean square over the part of the laser's plane that the camera sees."""
    volume = working_volume(there, 0, SIZE, NEAREST, FARTHEST)
    intrinsics, distortion, m = found
    q = normalise(volume.pixel, intrinsics, distortion)
    return float(np.mean((1.0 / (q @ m[:2] + m[2]) - volume.depth) ** 2))


@cache
def errors(title: str, seeds: int, name: str) -> np.ndarray:
    """(seeds,) m^2 by a way or, named "ours", by ours, of the views of a case."""
    way = by_ours if name == "ours" else WAYS[name][1]
    sets = (views_in(CASES[title], seed) for seed in range(seeds))
    return np.array([depth_error(there, way(views)) for there, views in sets])


@pytest.mark.parametrize("title", CASES)
@pytest.mark.parametrize("name", WAYS)
def test_depth_is_never_worse_than_by_a_peer(name: str, title: str) -> None:
    if not is_here(WAYS[name][0]):
        pytest.skip(f"{WAYS[name][0]} is not installed; make validate installs it, or tells how")
    ours, theirs = errors(title, SEEDS, "ours"), errors(title, SEEDS, name)
    # both err by the same noise: what is left of chance is the spread of their difference
    assert (ours - theirs).mean() <= 2.0 * (ours - theirs).std(ddof=1) / np.sqrt(SEEDS)


if __name__ == "__main__":
    count = int(sys.argv[1])
    print(f"true depth error, rms um over {NEAREST:g} to {FARTHEST:g} m and {count} seeds; in brackets its median")
    for title in CASES:
        print(title)
        own = errors(title, count, "ours")
        for name in ("ours", *WAYS):
            if name != "ours" and not is_here(WAYS[name][0]):
                print(f"  {name}: {WAYS[name][0]} is not installed")
                continue
            found = errors(title, count, name)
            worse, middle = np.sqrt(found.mean() / own.mean()), 1e6 * np.sqrt(np.median(found))
            print(f"  {name:52} {1e6 * np.sqrt(found.mean()):8.1f} ({middle:.1f}), {worse:.2f} times ours")
