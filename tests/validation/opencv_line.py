"""What thirty lines of OpenCV make of a photograph of a laser line: the yardstick of ours."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SHARE = 0.2
"""Of the brightest pixel, below which a row has no line."""
HALF = 6
"""px either side of the peak that its centre of mass is taken over."""


def light_of(image: NDArray[Any], colour: str, axis: str) -> NDArray[np.float32]:
    """(h, w) or (h, w, 3) -> the colour less the mean of the others, at least 0, scan lines as rows."""
    values = image.astype(np.float32)
    if values.ndim == 3:
        names = ("red", "green", "blue")
        if colour in names:
            k = names.index(colour)
            values = values[..., k] - 0.5 * (values.sum(axis=2) - values[..., k])
        else:
            values = values.mean(axis=2)
    return np.ascontiguousarray(np.maximum(values if axis == "rows" else values.T, 0.0))


def centre_of_mass(light: NDArray[np.float32]) -> Floats:
    """(n, w) -> (n,): centre of mass about each row's highest pixel after a blur of 1 px in both directions."""
    smooth = cv2.GaussianBlur(light, (0, 0), 1.0)
    peak = smooth.argmax(axis=1)
    at = np.clip(peak[:, None] + np.arange(-HALF, HALF + 1), 0, light.shape[1] - 1)
    near = np.take_along_axis(smooth, at, axis=1)
    near = np.maximum(near - near.min(axis=1, keepdims=True), 0.0)
    found = (near * at).sum(axis=1) / np.maximum(near.sum(axis=1), 1e-9)
    return np.where(smooth.max(axis=1) > SHARE * smooth.max(), found, np.nan)


def steger(light: NDArray[np.float32], sigma: float = 2.0) -> Floats:
    """(n, w) -> (n,): the strongest ridge point of each row (Steger, 1998), its offset along the normal projected."""
    smooth = cv2.GaussianBlur(light, (0, 0), sigma)
    dx, dy = (cv2.Sobel(smooth, cv2.CV_32F, *order, ksize=3) / 8.0 for order in ((1, 0), (0, 1)))
    dxx = cv2.filter2D(smooth, cv2.CV_32F, np.array([[1.0, -2.0, 1.0]]))
    dyy = cv2.filter2D(smooth, cv2.CV_32F, np.array([[1.0], [-2.0], [1.0]]))
    dxy = cv2.filter2D(smooth, cv2.CV_32F, np.array([[1.0, 0.0, -1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 1.0]]) / 4.0)
    middle, spread = 0.5 * (dxx + dyy), np.hypot(0.5 * (dxx - dyy), dxy)
    curve = middle - spread  # the most negative eigenvalue
    angle = 0.5 * np.arctan2(-2.0 * dxy, dyy - dxx)
    nx, ny = np.cos(angle), np.sin(angle)
    along = dxx * nx * nx + 2.0 * dxy * nx * ny + dyy * ny * ny
    t = -(dx * nx + dy * ny) / np.where(np.abs(along) > 1e-6, along, 1e-6)
    strength = np.where((np.abs(t * nx) <= 0.6) & (along < 0.0), -curve, 0.0)
    best = strength.argmax(axis=1)
    rows = np.arange(len(light))
    found = best + t[rows, best] * nx[rows, best]
    return np.where(strength.max(axis=1) > SHARE * strength.max(), found, np.nan)
