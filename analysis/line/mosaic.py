"""Of a mosaic that is filled in, the pixels that were seen: noise is told and lines are fitted by these alone.

What was put between them is their mean: as noisy as half of them, and between the pixels of a scan line no Gaussian,
so that it leaves something over of every fit, the more the brighter and narrower the line is.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.line.detection.channel import COLOURS, Lines
from analysis.line.detection.filled_in import seen_pixels
from analysis.line.measure import measure
from analysis.line.residuals import RUN
from analysis.line.settings import ExtractionSettings

RUNS = 16
"""Runs of neighbouring scan lines looked at."""
ASKED, FEWEST_ROWS = 2**17, 64
"""Pixels, and scan lines, that are asked whether they are filled in."""
FINE = 1.2
"""px; a line that is filled in narrower, of 0.95 px and less, is on too few pixels that were seen to be fitted."""


def some_runs(image: NDArray[Any]) -> NDArray[Any]:
    """(h, ...) -> runs of neighbouring rows, evenly spread; each begins on an even row, as Bayer patterns do."""
    if len(image) <= RUNS * RUN:
        return image
    starts = np.linspace(0, (len(image) - RUN) // 2, RUNS).astype(np.intp) * 2
    return image[(starts[:, None] + np.arange(RUN)).ravel()]


def seen_only(lines: Lines, image: NDArray[Any], settings: ExtractionSettings, threads: int | None) -> Lines:
    """Some scan lines of an image (n, w) or (n, w, 3) -> the same without the pixels that a mosaic's colour is filled
    in at; as they are where it is not, or where the line is too narrow for the pixels that were seen.

    lines: with a noise that a line rises above.
    """
    grey = image.ndim == 3 and lines.channel not in COLOURS
    if grey or lines.pattern is not None or lines.variance is not None or lines.smoothing > 0.0:
        return lines
    rows = max(ASKED // image.shape[1], FEWEST_ROWS)
    start = max(len(image) - rows, 0) // 4 * 2  # in the middle, and even
    some = image[start : start + rows]
    seen = seen_pixels(some if some.ndim == 2 else some[..., COLOURS.index(lines.channel)], lines.noise.step)
    if seen is None:
        return lines
    alone = settings.model_copy(update={"method": "likelihood", "peaks": 1})
    width = measure(replace(lines, image=some_runs(lines.image)), alone, threads).width
    wide = np.isfinite(width).any() and float(np.nanmedian(width)) >= FINE
    return replace(lines, seen=seen) if wide else lines


def seen_rows(lines: Lines, image: NDArray[Any]) -> Lines:
    """Some scan lines of an image (n, w) or (n, w, 3), without the pixels filled in -> as many of those with pixels
    that were seen."""
    if lines.seen is None or lines.seen.any(axis=1).all():
        return lines
    first = int(np.argmax(lines.seen.any(axis=1)))
    return replace(lines, image=some_runs(image[first::2]), seen=lines.seen[[first, first]])
