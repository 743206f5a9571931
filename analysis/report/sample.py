"""A sample of a scan's points of bounded size, for what sums cannot give: quantiles, correlations and pictures.

It consists of whole runs of neighbouring scan lines, so that it preserves the correlation of neighbours' errors. A scan
within the bound is kept whole, and its figures are exact.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from analysis.cloud import at_first_step
from analysis.report.frame_result import Extraction
from analysis.spool import Spool
from render.scene.scene import Scene

Rows = NDArray[np.void]
"""(m,) of `ROW`, in the order of `Points`."""

ROW = np.dtype(
    [
        ("index", "i8"), ("rank", "i4"), ("flag", "u1"), ("valid", "?"), ("width", "f8"), ("world", "f8", 3),
        ("position", "f8"), ("depth", "f8"), ("off_surface", "f8"), ("sheet_bias", "f8"),
        ("sigma_position", "f8"), ("sigma_depth", "f8"), ("sigma_off_surface", "f8"),
        ("pixel_depth", "f8"), ("pixel_distance", "f8"), ("sigma_systematic", "f8"), ("alike", "f8"), ("shared", "f8"),
        ("systematic_off_surface", "f8"),
    ]
)  # fmt: skip
"""Fields of a point: `index`, `rank`, `flag`, `width` (px) of its peak; whether it is `valid`; its position at step 0
(`world`, m); its errors and their predicted sigma (px, m); the sheet's bias of the position (px); the errors in m for
one pixel; the calibration's part of sigma in depth, m; the correlation length (`alike`), scan lines,
of what is not the error in depth that narrow lines have in common (`shared`), m; and the part of sigma along the
surface's normal that neighbours have in common, m.
"""

MOST_LINES = 1 << 18
"""Largest number of scan lines kept, of all lasers together: 128 frames of 2048."""
RUN = 64
"""Number of neighbouring scan lines that are kept or dropped together."""
SEED = 20_240_607
IMAGE = 1_000_000
"""Offset between the scan lines of different images, so that they are never taken for neighbours."""


def rows_of(extraction: Extraction, scene: Scene, step: int) -> Rows:
    """What is kept of a line's points."""
    line, points, errors = extraction.line, extraction.points, extraction.errors
    rows = np.empty(len(points.flag), ROW)
    rows["index"], rows["rank"], rows["valid"] = points.index, points.rank, points.valid
    rows["flag"], rows["width"] = line.flag[points.index, points.rank], line.width[points.index, points.rank]
    rows["world"] = at_first_step(points.world, scene, step)
    rows["position"], rows["depth"], rows["off_surface"] = errors.position, errors.depth, errors.off_surface
    rows["sheet_bias"] = errors.sheet_bias
    rows["sigma_position"], rows["sigma_depth"] = points.sigma_pixel, points.sigma_depth
    rows["sigma_off_surface"] = errors.sigma_off_surface
    rows["systematic_off_surface"] = errors.systematic_off_surface
    rows["sigma_systematic"] = points.sigma_depth_systematic
    rows["alike"] = 1.0 if line.length_apart is None else line.length_apart[points.index, points.rank]
    shared = 0.0 if line.shared_u is None else line.shared_u[points.index, points.rank]
    rows["shared"] = shared * points.gradient[:, 2]
    rows["pixel_depth"] = np.abs(points.gradient[:, 2])
    rows["pixel_distance"] = np.linalg.norm(points.gradient, axis=1)
    return rows


class Sample:
    """A seeded, uniform random sample of runs, the same runs for every method.

    Their points wait in a file, where those that come take the places of those that go.
    """

    def __init__(self, most: int = MOST_LINES, folder: Path | None = None) -> None:
        """folder: as `Spool`."""
        self._most = most
        self._images = 0
        self._kept = 0
        self._seen: dict[int, int] = {}
        self._runs: dict[tuple[int, int], tuple[int, int, int | None, tuple[int, ...]]] = {}
        """By image and run: the laser, how many scan lines, where they are in the file, and of how many bytes their
        points by each method are."""
        self._drawn: list[tuple[float, int, int]] = []
        """A heap of the same runs, the first to go first."""
        self._spool = Spool(folder)
        self._left: dict[int, list[int]] = {}
        """Places in the file that runs of so many bytes have left."""

    def add(self, laser: int, lines: int, methods: Sequence[Rows]) -> None:
        """The points of one image of a laser, with `lines` scan lines, by each method. InputError: as `Spool`."""
        starts = np.arange(0, lines, RUN)
        lots = np.random.default_rng([SEED, self._images]).random(len(starts))
        edges = [np.searchsorted(rows["index"], np.append(starts, lines)) for rows in methods]
        self._seen[laser] = self._seen.get(laser, 0) + lines
        for run, lot in enumerate(lots.tolist()):
            size = min(RUN, lines - run * RUN)
            self._kept += size
            heapq.heappush(self._drawn, (-lot, self._images, run))
            self._runs[self._images, run] = laser, size, None, ()
            while self._kept > self._most:
                self._drop()
            if (self._images, run) in self._runs:
                parts = [rows[edge[run] : edge[run + 1]].tobytes() for rows, edge in zip(methods, edges, strict=True)]
                self._runs[self._images, run] = laser, size, self._put(b"".join(parts)), tuple(map(len, parts))
        self._images += 1

    def _drop(self) -> None:
        _, image, run = heapq.heappop(self._drawn)
        _, size, place, lengths = self._runs.pop((image, run))
        self._kept -= size
        if place is not None:
            self._left.setdefault(sum(lengths), []).append(place)

    def _put(self, data: bytes) -> int:
        places = self._left.get(len(data))
        return self._spool.put(data, places.pop() if places else None)

    def rows(self, laser: int | None, method: int) -> Rows:
        """The points kept of a laser, or of all, by a method, in the order of the scan."""
        found, images, sizes = [], [], []
        for (image, _), (of, _, place, lengths) in sorted(self._runs.items(), key=lambda item: item[0]):
            if laser in (None, of) and method < len(lengths) and place is not None:
                found.append(self._spool.read(place + sum(lengths[:method]), lengths[method]))
                images.append(image)
                sizes.append(lengths[method] // ROW.itemsize)
        rows = np.frombuffer(bytearray().join(found), ROW)
        rows["index"] += IMAGE * np.repeat(np.array(images, np.int64), sizes)
        return rows

    def lines(self, laser: int | None) -> tuple[int, int]:
        """How many scan lines were kept, and how many there were."""
        kept = sum(size for of, size, _, _ in self._runs.values() if laser in (None, of))
        return kept, sum(seen for of, seen in self._seen.items() if laser in (None, of))

    def close(self) -> None:
        self._spool.close()
