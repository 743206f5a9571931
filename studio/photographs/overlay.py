"""A picture of a photograph with its line on it: points, their sigma, and the scan lines without one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.line.result import CAUTIOUS, Flag, Line
from render.base.files import atomic_write
from studio.photographs.photographs import Measured

SMALLEST, LARGEST = 900, 1800
"""px of the picture's longer side, between which an image keeps its size: smaller ones are enlarged by a whole factor,
larger ones shrunk."""
BAR = 10.0
"""Times sigma: one sigma is far less than a pixel."""
EDGE = 10
"""px beside the image, where scan lines without a point have their mark."""
LEGEND, LEGEND_WIDTH = 26, 700
"""px of its height, and of a picture that it is as large as it has to be for; in wider ones it grows with them."""
GOOD, DOUBTFUL, LOST, NOTHING, INK = (0, 230, 0), (0, 190, 255), (60, 60, 255), (70, 70, 70), (235, 235, 235)
"""B, G, R."""


def draw_overlay(image: NDArray[Any], line: Line) -> NDArray[np.uint8]:
    """Image (h, w) or (h, w, 3) and its line -> picture (h', w', 3), B, G, R.

    Dark images are brightened so that what is beside the line can be seen.
    """
    canvas, scale = _brightened(image)
    fine = 4
    rows = line.axis == "rows"
    index, rank = np.nonzero(line.valid)
    for i, k in zip(index, rank, strict=True):
        u, half = line.u[i, k], BAR * np.nan_to_num(line.sigma_u[i, k])
        colour = DOUBTFUL if line.flag[i, k] in CAUTIOUS else GOOD
        ends = [((at + 0.5) * scale - 0.5, (i + 0.5) * scale - 0.5) for at in (u - half, u + half)]
        first, last = (tuple(round(fine_of * 2**fine) for fine_of in (end if rows else end[::-1])) for end in ends)
        cv2.line(canvas, first, last, colour, 1, cv2.LINE_AA, fine)
        middle = [round((u + 0.5) * scale - 0.5), round((i + 0.5) * scale - 0.5)]
        x, y = middle if rows else middle[::-1]
        canvas[min(y, canvas.shape[0] - 1), min(x, canvas.shape[1] - 1)] = colour
    return _with_legend(canvas, line, scale)


def _brightened(image: NDArray[Any]) -> tuple[NDArray[np.uint8], float]:
    """The image as 8 bit colour of a size to look at, and how much larger it became."""
    grey = image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)
    values = np.nan_to_num(grey[..., ::-1].astype(np.float32))
    low, high = np.percentile(values[::4, ::4], (1.0, 99.8))
    high = max(high, low + 1e-6 * max(abs(low), 1.0), low + 0.2 * (float(values.max()) - low))
    shown = (255.0 * np.clip((values - low) / (high - low), 0.0, 1.0) ** 0.6).astype(np.uint8)
    side = max(image.shape[:2])
    scale = LARGEST / side if side > LARGEST else float(max(1, -(-SMALLEST // side)))
    size = (round(image.shape[1] * scale), round(image.shape[0] * scale))
    how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_NEAREST
    return np.ascontiguousarray(cv2.resize(shown, size, interpolation=how)), scale


def _with_legend(canvas: NDArray[np.uint8], line: Line, scale: float) -> NDArray[np.uint8]:
    """Marks of scan lines without a point at the edge, and what the colours mean below."""
    rows = line.axis == "rows"
    lost = ~np.asarray(line.valid).any(axis=1).reshape(-1)
    nothing = np.isin(line.flag[:, 0], (Flag.NO_PEAK, Flag.NO_PIXELS))
    length = canvas.shape[0] if rows else canvas.shape[1]
    marks = np.zeros((length, EDGE, 3), np.uint8)
    at = np.minimum(((np.arange(length) + 0.5) / scale).astype(int), len(lost) - 1)
    marks[lost[at] & nothing[at]] = NOTHING
    marks[lost[at] & ~nothing[at]] = LOST
    marks[:, :2] = 0
    canvas = np.hstack([canvas, marks]) if rows else np.vstack([canvas, marks.transpose(1, 0, 2)])
    large = max(canvas.shape[1] / LEGEND_WIDTH, 1.0)
    middle, box, size, thick = (round(values * large) for values in (0.5 * LEGEND, 10, 100, 0.75))
    legend = np.zeros((2 * middle, canvas.shape[1], 3), np.uint8)
    what, x = "rows" if rows else "columns", round(8 * large)
    for colour, text in (
        (GOOD, f"line, bar {BAR:g} sigma"),
        (DOUBTFUL, "with a flag"),
        (LOST, f"{what} rejected"),
        (NOTHING, f"{what} without a line"),
    ):
        font = cv2.FONT_HERSHEY_SIMPLEX, 0.0042 * size
        cv2.rectangle(legend, (x, middle - box // 2), (x + box, middle + box // 2), colour, -1)
        cv2.putText(legend, text, (x + 3 * box // 2, middle + box // 2), *font, INK, max(thick, 1), cv2.LINE_AA)
        x += 3 * box + cv2.getTextSize(text, *font, max(thick, 1))[0][0]
    return np.vstack([canvas, legend])


def write_overlay(path: Path, measured: Measured) -> Path:
    """The picture as a PNG."""
    data = cv2.imencode(".png", draw_overlay(measured.image, measured.line))[1].tobytes()
    with atomic_write(path) as temporary:
        temporary.write_bytes(data)
    return path
