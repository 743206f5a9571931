"""Bright ridges across the scan lines of a shrunk image: where a line may be, at whichever of a few widths."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Ridges = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
SCALES = (1.0, 2.0, 4.0, 8.0)
"""Gaussian sigmas of the ridge filters, px of the shrunk image: lines up to a few per cent of the image's width."""
CANDIDATES = 5
COMPARABLE = 0.5
"""A narrow line answers a filter twice its width with a third of its strength, a plateau with nearly all."""
FAR, FALL = 3.0, 0.56
"""Sigmas of the filter to either side at which a ridge has fallen, and what makes its fall as much as its bend: for a
Gaussian of the filter's own width, (1/2)^(3/2) of its height over (1 - exp(-9/4)) / 2^(1/2)."""


def ridge_peaks(light: Floats, closed: NDArray[np.bool_] | None = None) -> Ridges:
    """(n, w) -> (n, k) positions, strengths and filter sigmas of the strongest bright ridges across each row."""
    response = np.zeros(light.shape, np.float32)
    widest = np.zeros(light.shape, np.float32)
    for scale in SCALES:
        smooth = cv2.GaussianBlur(light, (0, 0), scale, borderType=cv2.BORDER_REPLICATE)
        # Lindeberg (1998), eq. 42: with the power 3/2 a Gaussian ridge answers most at its own width
        bent = -(scale**1.5) * cv2.Sobel(smooth, cv2.CV_32F, 2, 0, ksize=1, borderType=cv2.BORDER_REPLICATE)
        # an edge is bent as well, but falls to one side only
        np.minimum(bent, FALL / scale**0.5 * _fall(smooth, round(FAR * scale)), out=bent)
        np.copyto(widest, scale, where=bent > response)
        np.maximum(response, bent, out=response)
    if closed is not None:
        response[cv2.dilate(closed.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0] = 0.0
    inner = response[:, 1:-1]
    peaked = np.where((inner >= response[:, :-2]) & (inner > response[:, 2:]) & (inner > 0), inner, 0)
    count = min(CANDIDATES, peaked.shape[1])
    order, strength = np.zeros((len(light), count), np.intp), np.zeros((len(light), count))
    rows = np.arange(len(light))
    for k in range(count):  # each is found many times faster than all of them by order
        order[:, k] = peaked.argmax(axis=1)
        strength[:, k] = peaked[rows, order[:, k]]
        peaked[rows, order[:, k]] = 0.0
    widths = np.take_along_axis(widest, order + 1, axis=1).astype(np.float64)
    there = strength > 0
    there &= ~_flanks(order, strength, widths)
    left, right = np.take_along_axis(response, order, axis=1), np.take_along_axis(response, order + 2, axis=1)
    bend = np.maximum(2.0 * strength - left - right, 1e-12)
    u = order + 1.0 + 0.5 * (right - left) / bend
    return np.where(there, u, np.nan), np.where(there, strength, np.nan), widths


def _fall(smooth: Floats, far: int) -> Floats:
    """How far each pixel (n, w) is above both of those so far to its left and right; beyond the image it is level."""
    width = smooth.shape[1]
    wider = cv2.copyMakeBorder(smooth, 0, 0, far, far, cv2.BORDER_REPLICATE)
    return np.asarray(smooth - np.maximum(wider[:, :width], wider[:, 2 * far :]))


def _flanks(order: NDArray[np.intp], strength: NDArray[np.float64], scale: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which candidates (n, k) are an edge of a wider ridge of comparable strength, as of a saturated plateau."""
    apart = np.abs(order[:, :, None] - order[:, None, :])
    wider = scale[:, None, :] > scale[:, :, None]
    within = apart < 2.0 * scale[:, None, :]
    return np.asarray((wider & within & (strength[:, None, :] > COMPARABLE * strength[:, :, None])).any(axis=2))
