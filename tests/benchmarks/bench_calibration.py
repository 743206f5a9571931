"""CPU time of the joint adjustment of 38 views of a 13 x 9 board with three lasers, and of its checks.

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
from analysis.calibration.estimate import free_parameters
from analysis.calibration.observations import gather
from analysis.calibration.robust import adjust_robustly
from analysis.calibration.start import start
from analysis.calibration.virtual import noisy
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

VIEWS, TERMS, LASERS, REPEATS = 38, 5, 3, 5
BAR_S = 1.0


def seconds(work: Callable[[], object]) -> float:
    """CPU time, best of a few."""
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        work()
        times.append(time.process_time() - begun)
    return min(times)


def main() -> int:
    there = truth(0, VIEWS, terms=TERMS, lasers=LASERS)
    views = noisy(views_of(there), np.random.default_rng(0))
    seen, guess = gather(views, target()), start(views, SIZE, TERMS, LASERS)
    free = free_parameters(guess, warp=True)
    print(f"{VIEWS} views, {LASERS} lasers, {len(seen.view)} corners, {len(seen.laser)} points of lines")
    least_squares = seconds(lambda: adjust(seen, guess, free))
    print(f"least squares from the first guess {least_squares:.2f} s of CPU, bar {BAR_S:g} s")
    robust = adjust_robustly(seen, guess, free)
    print(f"with what does not belong left out {seconds(lambda: adjust_robustly(seen, guess, free)):.2f} s")
    volumes = [working_volume(robust.solution.estimate, laser, SIZE, 0.7, 1.0) for laser in range(LASERS)]
    print(f"halves solved apart {seconds(lambda: halves(robust, volumes)):.2f} s, ", end="")
    print(f"whiteness {seconds(lambda: whiteness(robust)):.2f} s")
    return int(least_squares > BAR_S)


if __name__ == "__main__":
    sys.exit(main())
