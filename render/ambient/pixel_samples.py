"""Samples of single pixels: as many on each as whoever asks for them wants, in two halves that know nothing of each
other."""

from __future__ import annotations

import numpy as np

from render.ambient.directions import Draws
from render.ambient.path_kernels import Film
from render.ambient.path_state import CLAMPED_RADIANCE
from render.ambient.path_tracer import WAVEFRONT, CameraPaths
from render.base.arrays import Float, Float32, Int, Long
from render.run import Run

ROUND = 1 << 10
"""Most samples of a half that a pixel is given at a time, so that no pixel fills a wave."""


class PixelSamples:
    """Sums over the samples of some pixels of an image."""

    def __init__(self, pixels: Int) -> None:
        """pixels: (m,) ascending."""
        self.pixels = pixels
        self.sums = np.zeros((len(pixels), 2, 3), np.float32)
        self.spread = np.zeros((len(pixels), 2, 3), np.float32)
        """Estimate of the variance of a single sample, by each half's last samples beside those before them."""
        self.done = np.zeros((len(pixels), 2), np.int32)
        self.invalid_counts = np.zeros(2)
        self.cut = 0.0
        """Sum of what the clamp took of the samples."""
        self.apart = 0
        """Samples that are in no pixel: forgotten, or learned from."""

    @property
    def total(self) -> int:
        """Samples so far."""
        return int(self.done.sum(dtype=np.int64)) + self.apart

    def extend(self, pixels: Int) -> None:
        """Take on more pixels, in any order."""
        before, self.pixels = self.pixels, np.union1d(self.pixels, pixels).astype(np.int32)
        place = self.place(before)
        for name in ("sums", "spread", "done"):
            old = getattr(self, name)
            new = np.zeros((len(self.pixels), *old.shape[1:]), old.dtype)
            new[place] = old
            setattr(self, name, new)

    def place(self, pixels: Int) -> Long:
        """(n,) where some pixels are among all."""
        return np.searchsorted(self.pixels, pixels)

    def forget(self, pixels: Int) -> None:
        """Leave out all samples of some pixels so far."""
        place = self.place(pixels)
        self.apart += int(self.done[place].sum(dtype=np.int64))
        self.sums[place], self.spread[place], self.done[place] = 0.0, 0.0, 0

    def means(self, pixels: Int | None = None) -> Float32:
        """(n, 2, 3) radiance of both halves of some pixels, or of all; each half must have samples."""
        some = slice(None) if pixels is None else self.place(pixels)
        return np.asarray(self.sums[some] / self.done[some][..., None], dtype=np.float32)

    def add(self, paths: CameraPaths, pixels: Int, count: Int | Float, run: Run, draws: Draws | None = None) -> None:
        """Samples until each of some pixels (n,), all different, has count (n, 2) of both halves. Raises Cancelled.

        draws: as for `CameraPaths.add`.
        """
        place, draws = self.place(pixels), Draws(pixels) if draws is None else draws
        while True:
            more = np.clip(count - self.done[place], 0, ROUND).astype(np.int32)
            wanting = np.flatnonzero(more.any(axis=1))
            if not len(wanting):
                return
            self._add_round(paths, place[wanting], draws.of(wanting), more[wanting], run)

    def _add_round(self, paths: CameraPaths, place: Long, draws: Draws, more: Int, run: Run) -> None:
        rays = more.sum(axis=1, dtype=np.int64)
        chunk = (np.cumsum(rays) - rays) // (WAVEFRONT - 2 * ROUND)
        edges = np.append(np.flatnonzero(np.diff(chunk, prepend=-1)), len(place))
        counts, cut = np.zeros((len(edges) - 1, 2)), np.zeros(len(edges) - 1)

        def work(start: int, stop: int) -> None:
            for i in range(start, stop):
                some = slice(edges[i], edges[i + 1])
                cut[i] = self._trace(paths, place[some], draws.of(some), more[some], counts[i], run)

        run.map(work, len(edges) - 1, 1)
        # in the order of the chunks, whichever thread was first
        self.invalid_counts += counts.sum(axis=0)
        self.cut += float(cut.sum())

    def _trace(
        self, paths: CameraPaths, place: Long, draws: Draws, more: Int, invalid_counts: Float, run: Run
    ) -> float:
        sums, first = np.zeros((2 * len(place), 4)), self.done[place]
        paths.add(self.pixels[place], first, more, Film(sums, invalid_counts), run.cancelled, draws)
        new, old = sums.reshape(-1, 2, 4)[..., :3].astype(np.float32), self.sums[place]
        before, added = np.maximum(first, 1)[..., None], np.maximum(more, 1)[..., None]
        variance = (old / before - new / added) ** 2 / (1.0 / before + 1.0 / added)
        both = (first > 0) & (more > 0)
        self.spread[place] = np.where(both[..., None], variance, self.spread[place])
        self.sums[place] = old + new
        self.done[place] = first + more
        return float(sums[:, CLAMPED_RADIANCE].sum())
