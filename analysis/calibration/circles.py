"""Circle grids: centroids of dark discs with their covariance, and how far they are from the images of the centres.

What an image tells of a disc is the centroid of its area, which is not the image of its centre: perspective and
distortion move it by a few tenths of a pixel. With f from the board to the image and D its area element, it is the mean
of f weighted by D over the disc, taken here by quadrature of the exact f. Source: Heikkila, Geometric camera
calibration using circular control points, 2000.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from analysis.calibration.estimate import Estimate
from analysis.calibration.lens import project
from analysis.calibration.observations import Index
from render.base.arrays import Bool, Float

RADII = np.sqrt(0.5 + 0.5 * np.array([-0.7745966692414834, 0.0, 0.7745966692414834]))
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0
"""Of a disc of radius 1: Gauss's three points in the square of the radius, each on all of its circle."""
ANGLES = 12
MARGIN, RING = 3.0, 3.0
"""px of the white about a disc: what its blurred edge may reach, and where the paper's brightness is taken."""
SMALLEST = 4.0
"""px, half the shorter axis of an ellipse."""


def centre_bias(estimate: Estimate, view: Index, target: Float, radius: float) -> Float:
    """(n, 2) px, centroid of each disc's image less the image of its centre; view (n,), target (n, 2) m, radius m.

    The board is taken as flat: a bend of it tilts a disc by far too little to matter.
    """
    angle = np.arange(ANGLES) * (2.0 * np.pi / ANGLES)
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    offset = np.concatenate([np.zeros((1, 2)), (radius * RADII[:, None, None] * ring).reshape(-1, 2)])
    weight = np.concatenate([[0.0], np.repeat(WEIGHTS / ANGLES, ANGLES)])
    place = target[:, None, :] + offset
    rotation, translation = estimate.rotation[view], estimate.translation[view]
    point = np.einsum("nij,nkj->nki", rotation[:, :, :2], place) + translation[:, None, :]
    q = point[:, :, :2] / point[:, :, 2:]
    pixel, by_q, _ = project(q.reshape(-1, 2), estimate.intrinsics, estimate.distortion)
    pixel, lens = pixel.reshape(q.shape), np.linalg.det(by_q).reshape(q.shape[:2])
    # area of the normalised plane for area of the board: n . t / z^3
    area = lens * (np.einsum("ni,ni->n", rotation[:, :, 2], translation)[:, None] / point[:, :, 2] ** 3) * weight
    return np.asarray(np.einsum("nk,nki->ni", area, pixel) / area.sum(axis=1)[:, None] - pixel[:, 0])


def find_circles(shown: NDArray[np.uint8], columns: int, rows: int) -> Float | None:
    """(columns rows, 2) px about where the dark discs are, row by row, or None."""
    settings = cv2.SimpleBlobDetector.Params()
    settings.minArea, settings.maxArea = np.pi * SMALLEST**2, shown.size / 100.0
    settings.minConvexity, settings.filterByInertia = 0.9, False
    settings.filterByColor, settings.minDistBetweenBlobs = False, 2.0 * SMALLEST
    detector = cv2.SimpleBlobDetector.create(settings)
    for flags in (cv2.CALIB_CB_SYMMETRIC_GRID, cv2.CALIB_CB_SYMMETRIC_GRID | cv2.CALIB_CB_CLUSTERING):
        found, centres = cv2.findCirclesGrid(shown, (columns, rows), flags=flags, blobDetector=detector)
        if found:
            return np.asarray(centres, dtype=np.float64).reshape(-1, 2)
    return None


def refine_circles(image: Float, detected: Float, spacing: Float, noise: Float) -> tuple[Float, Float, Bool]:
    """Centroids (n, 2) px of dark discs near those detected, covariance (n, 2, 2) px^2, and which are good.

    image (h, w) of any scale; spacing (n,) px to the nearest other disc; noise (2,) as in `corners.refine`.
    The share of darkness m = 1 - I / B, with the paper's brightness B a plane about the disc, has the disc's centroid
    whatever the blur and the light's gradient; noise of I and of B is carried through it.
    """
    centre, covariance = detected.copy(), np.tile(np.eye(2), (len(detected), 1, 1))
    good = np.zeros(len(detected), dtype=bool)
    for i, (at, gap) in enumerate(zip(detected, spacing, strict=True)):
        found = _disc(image, at, gap, noise)
        if found is not None:
            centre[i], covariance[i], good[i] = *found, True
    return centre, covariance, good


def _disc(image: Float, at: Float, gap: float, noise: Float) -> tuple[Float, Float] | None:
    reach = int(np.ceil(gap))
    column, row = np.rint(at).astype(int)
    if min(column, row) < reach or column + reach >= image.shape[1] or row + reach >= image.shape[0]:
        reach = min(column, row, image.shape[1] - 1 - column, image.shape[0] - 1 - row)
        if reach < 0.5 * gap:
            return None
    patch = image[row - reach : row + reach + 1, column - reach : column + reach + 1]
    dark, bright = np.quantile(patch, [0.02, 0.9])
    mask = (patch < 0.5 * (dark + bright)).astype(np.uint8)
    _, labels = cv2.connectedComponents(mask)
    own = labels == labels[reach, reach]
    if not mask[reach, reach] or own[[0, -1]].any() or own[:, [0, -1]].any():
        return None
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.float64)
    dx, dy = x - x[own].mean(), y - y[own].mean()
    spread = np.cov(np.stack([dx[own], dy[own]])) + 1e-9 * np.eye(2)
    half = 2.0 * np.sqrt(np.linalg.eigvalsh(spread)[0])  # an ellipse's axes are twice its standard deviations
    filled = own.sum() / (4.0 * np.pi * np.sqrt(np.linalg.det(spread)))
    if half < SMALLEST or not 0.9 < filled < 1.1:
        return None
    inverse = np.linalg.inv(spread)
    scale = 0.5 * np.sqrt(inverse[0, 0] * dx**2 + 2.0 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy**2)
    edge = 1.0 + MARGIN / half
    inner, ring = scale < edge, (scale >= edge) & (scale < edge + RING / half)
    if inner[[0, -1]].any() or inner[:, [0, -1]].any() or (mask.astype(bool) & ring).any():
        return None
    ones = np.stack([np.ones(x.shape), x, y], axis=-1)
    matrix, seen = ones[ring], patch[ring]
    normal = np.linalg.inv(matrix.T @ matrix)
    plane = normal @ matrix.T @ seen
    paper = (normal @ matrix.T * np.maximum(noise[0] + noise[1] * seen, 1e-12)) @ matrix @ normal
    level = ones[inner] @ plane
    if np.any(level <= 0.0):
        return None
    light, place = patch[inner], np.stack([x[inner], y[inner]], axis=1)
    share = 1.0 - light / level
    total = share.sum()
    middle = share @ place / total
    arm = (place - middle) / total
    by_light = -arm / level[:, None]
    by_plane = (arm * (light / level**2)[:, None]).T @ ones[inner]
    variance = np.maximum(noise[0] + noise[1] * light, 1e-12)
    covariance = (by_light * variance[:, None]).T @ by_light + by_plane @ paper @ by_plane.T
    return middle + np.array([column, row]), covariance
