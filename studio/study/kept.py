"""What is kept of a cell beside its numbers: a profile or the image, for charts that show the thing itself, or errors.

A chart's is of the first repeat alone, in the row, rounded far below what a figure shows.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from typing import Any

import numpy as np

from analysis.error import Errors
from analysis.triangulate import Points
from render.frame import LaserCurve
from render.sensor.develop import Image

KEPT = ("profile", "pictures")
"""Charts that need something kept."""
ERRORS = "errors"
"""Kept for a comparison of two projects, point by point."""
ROW = "kept"
"""Of a row, what is kept of its cell."""
UNKNOWN = 1.0
"""px of predicted sigma: as far off a point counts as wrong (`analysis.error.Errors.outlier`)."""
UNSURE = 10.0
"""Times the median of the predicted sigmas: a point so unsure has a hundredth of the weight of a usual one."""
WIDEST = 640
"""px of a picture."""


def profile(points: Points, errors: Errors, curve: LaserCurve) -> dict[str, list[float]]:
    """Positions (px), depths and depth errors (m) along the scan lines, measured and true."""
    valid = points.valid
    across = 0 if points.axis == "rows" else 1
    return {
        "line": points.index[valid].tolist(),
        "position": np.round(points.pixel[valid, across], 3).tolist(),
        "depth": np.round(points.camera[valid, 2], 7).tolist(),
        "error": [None if not np.isfinite(one) else round(one, 8) for one in errors.depth[valid].tolist()],
        "true_line": curve.index.tolist(),
        "true_position": np.round(curve.position, 3).tolist(),
        "true_depth": np.round(curve.depth_z, 7).tolist(),
    }


def on_the_line(points: Points, errors: Errors, seconds: Mapping[str, float]) -> dict[str, Any]:
    """Depth errors (m) of the points on the line by its crossing, and the seconds of each stage of the render.

    wrong: rows with a point off the line, on no line, or that tells itself to be useless by its sigma, UNKNOWN or
    UNSURE; complete: rows with a point on the line. Both over the rows on which it can be seen.
    """
    sigma = points.sigma_pixel
    usual = float(np.median(sigma[np.isfinite(sigma)])) if np.isfinite(sigma).any() else np.inf
    unknown = sigma > min(UNKNOWN, UNSURE * usual)
    right = np.isfinite(errors.depth) & ~errors.outlier & ~unknown
    wrong = np.unique(points.index[errors.outlier | (np.isfinite(errors.depth) & unknown)])
    visible = max(errors.truth_rows, 1)
    return {
        "crossing": errors.truth[right].tolist(),
        "error": errors.depth[right].tolist(),
        "wrong": (len(wrong) + errors.false_rows) / visible,
        "complete": len(np.unique(points.index[right])) / visible,
        "stages": dict(seconds),
    }


def picture(image: Image) -> str:
    """PNG in base64: black level to saturation as the fourth root, which shows the dark; no wider than WIDEST."""
    from PIL import Image as Pillow

    grey = np.asarray(image.grey, dtype=np.float64)
    step = max(1, -(-grey.shape[1] // WIDEST))
    height, width = (side // step * step for side in grey.shape)
    small = grey[:height, :width].reshape(height // step, step, width // step, step).mean(axis=(1, 3))
    light = np.clip((small - image.black_level) / (image.saturation - image.black_level), 0.0, 1.0)
    buffer = io.BytesIO()
    Pillow.fromarray(np.round(255.0 * light**0.25).astype(np.uint8)).save(buffer, "PNG")
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def picture_pixels(text: str) -> Any:
    """(h, w) uint8 of what `picture` made."""
    from PIL import Image as Pillow

    return np.asarray(Pillow.open(io.BytesIO(base64.b64decode(text))))
