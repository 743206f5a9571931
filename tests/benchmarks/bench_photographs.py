"""Processor seconds of a colour JPEG of 5 Mpx, from its file to its line, by the defaults of `main.py extract`.

What it looks at first is done once for a set, and stands apart. The machine may be shared: the least of several runs.

    python tests/benchmarks/bench_photographs.py [runs]
"""

from __future__ import annotations

import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import cv2

from analysis.line.extract import settings_of
from studio.photographs.image_files import load_photograph
from studio.photographs.photograph_set import NEARBY, Wishes, look_at
from studio.photographs.photographs import extract_photograph
from tests.validation.drawn_photographs import DRAWINGS, drawn

SIZE = (2448, 2048)


def times(path: Path) -> tuple[float, float, float]:
    """Reading alone; looking at it, with reading; looking at it and measuring."""
    clock = time.process_time
    begin = clock()
    load_photograph(path)
    read = clock()
    settings = settings_of(None, select="continuous", smooth_along=True)
    look = look_at([path], settings, Wishes(count_lines=True, longest=NEARBY))
    looked = clock()
    extract_photograph(path, look)
    return read - begin, looked - read, clock() - read


if __name__ == "__main__":
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    with tempfile.TemporaryDirectory() as folder:
        for name in ("green board level", "red board", "blue jpeg"):
            drawing = DRAWINGS[name]
            path = Path(folder) / "drawn.jpg"
            image = drawn(replace(drawing, size=SIZE, sigma=2.5))[2]
            cv2.imwrite(str(path), image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 88])
            taken = [times(path) for _ in range(runs + 1)][1:]  # the first compiles
            read, look, both = (min(column) for column in zip(*taken, strict=True))
            print(f"{name:18s} reading {read:.3f}, looking {look:.3f}, looking and measuring {both:.3f} s", flush=True)
