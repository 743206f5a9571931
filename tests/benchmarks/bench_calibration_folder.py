"""Seconds of `calibrate scanner` on a folder of 38 pairs of photographs of 2448 x 2048 pixels, from files to sigmas.

Run: python tests/benchmarks/bench_calibration_folder.py [pairs]. Drawing them takes longer than what is timed.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.virtual import exact_view
from analysis.line.extract import settings_of
from studio.calibration.board_text import parse_board
from studio.calibration.image_views import shots
from studio.calibration.material import photographed
from tests.analysis.calibration.boards import SIZE, target, truth
from tests.validation.test_calibration_photographs import photograph

PAIRS, BAR_S = 38, 60.0
BOARD = "checkerboard:13x9:25mm"
PEAK, WIDTH_PX = 90.0, 1.5


def draw(folder: Path, pairs: int) -> None:
    there, rng = truth(0, pairs, terms=5), np.random.default_rng(0)
    across = np.arange(SIZE[0])
    for i in range(pairs):
        seen = exact_view("", there, i, target() * [7.0 / 6.0, 5.0 / 4.0], SIZE, laser_step=1).stripes[0]
        line = np.zeros(SIZE[::-1])
        rows = np.rint(seen.pixel[:, 1]).astype(int)
        line[rows] = PEAK * np.exp(-0.5 * ((across - seen.pixel[:, :1]) / WIDTH_PX) ** 2)
        for name, light in (("off", 0.0), ("on", line)):
            image = np.clip(np.rint(0.5 * photograph(there, i, rng) + light), 0, 255).astype(np.uint8)
            cv2.imwrite(str(folder / f"pose_{i:02}_{name}.png"), image)


def main() -> int:
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    board = parse_board(BOARD)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        draw(folder, pairs)
        wall, processor = time.perf_counter(), time.process_time()
        found = photographed(shots(folder), board, settings_of(None, axis="rows", channel="auto"), lasers=True)
        read = time.perf_counter() - wall, time.process_time() - processor
        result = calibrate(found.views, board.target, Request(found.size, found.lasers, 5))
        whole = time.perf_counter() - wall, time.process_time() - processor
    print(f"{len(found.views)} of {pairs} boards found with {found.lasers} laser; errors: {list(found.errors)}")
    print(f"reading and detection {read[0]:.1f} s ({read[1]:.1f} s of CPU)")
    print(f"all                   {whole[0]:.1f} s ({whole[1]:.1f} s of CPU), bar {BAR_S:g} s")
    print(f"depth error {1e6 * result.depth[0].rms:.1f} um")
    return 0 if whole[0] <= BAR_S and len(found.views) == pairs else 1


if __name__ == "__main__":
    raise SystemExit(main())
