"""CPU time of the joint adjustment of 38 views of a 13 x 9 board with three lasers, and an axis, and of its checks.

Run: python tests/benchmarks/bench_calibration.py. CPU time of the process, so that a busy machine counts for little.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from analysis.calibration.adjust import adjust
from analysis.calibration.checks import halves, whiteness
from analysis.calibration.depth import working_volume
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.motion import Kind, started
from analysis.calibration.observations import Observations, gather
from analysis.calibration.robust import adjust_robustly
from analysis.calibration.start import start
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of
from tests.analysis.calibration.test_motion import KINDS, carried

VIEWS, TERMS, LASERS, ROWS, REPEATS = 38, 5, 3, 4, 5
BAR_S = 1.0


def seconds(work: Callable[[], object]) -> float:
    """CPU time, best of a few."""
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def adjusted(kind: Kind | None) -> tuple[Observations, Estimate, float]:
    """Views with lines, the guess that an adjustment begins with, and its CPU time, s; of boards that were carried."""
    there = truth(0, VIEWS, terms=TERMS, lasers=LASERS)
    there = there if kind is None else carried(kind, views=VIEWS, terms=TERMS, lasers=LASERS, seed=0)
    views = noisy(views_of(there, laser_step=ROWS), np.random.default_rng(0))
    seen, guess = gather(views, target()), start(views, SIZE, TERMS, LASERS)
    if kind is not None:
        motion = there.motion
        guess = guess.with_motion(started(kind, motion.group, motion.given, guess.rotation, guess.translation))
    free = free_parameters(guess, warp=True)
    taken = seconds(lambda: adjust(seen, guess, free))
    told = f"{len(seen.view)} corners, {len(seen.laser)} points of lines: {taken:.2f} s of CPU"
    print(f"{kind or 'free poses':10} {told}{'' if adjust(seen, guess, free).converged else ', not settled'}")
    return seen, guess, taken


def main() -> int:
    print(f"least squares of {VIEWS} views and {LASERS} lasers from the first guess, bar {BAR_S:g} s")
    times = [adjusted(kind)[2] for kind in KINDS]
    seen, guess, taken = adjusted(None)
    free = free_parameters(guess, warp=True)
    robust = adjust_robustly(seen, guess, free)
    print(f"with what does not belong left out {seconds(lambda: adjust_robustly(seen, guess, free)):.2f} s")
    volumes = [working_volume(robust.solution.estimate, laser, SIZE, 0.7, 1.0) for laser in range(LASERS)]
    print(f"halves solved apart {seconds(lambda: halves(robust, volumes)):.2f} s, ", end="")
    print(f"whiteness {seconds(lambda: whiteness(robust)):.2f} s")
    return int(max(taken, *times) > BAR_S)


if __name__ == "__main__":
    sys.exit(main())
