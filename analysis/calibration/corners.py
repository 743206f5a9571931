"""Corners of a board to a small part of a pixel, each with the covariance that the image's noise gives it.

A corner c is where no gradient of its surroundings has a component along the way to it: sum w g g^T (p - c) = 0 over
the pixels p (Foerstner and Guelch, 1987), weights w a Gaussian of sigma s about c. To first order the noise dg of the
gradients, a linear map of the pixels' noise, moves it by M^-1 sum w (g (p - c) . dg + dg g . (p - c)), with M the sum's
own derivative by -c, sum w g g^T (1 - (p - c) (p - c)^T / s^2). Gradients are taken at whole pixels: interpolated ones
would share their noise.
"""

from __future__ import annotations

import cv2
import numpy as np

from render.base.arrays import Bool, Float

ROUNDS = 20
SMALLEST_WINDOW, LARGEST_WINDOW = 3, 10
"""Half sides, px, of the surroundings that are looked at."""
ENOUGH = 2**19
"""Pixels that tell an image's noise, each of eight levels to half a percent."""
STRAYED = 2.0
"""px that a refined corner may be from where it was detected."""


def refine(image: Float, detected: Float, noise: Float, clear: float = 0.4) -> tuple[Float, Float, Bool]:
    """Corners (n, 2) px near those detected, covariance (n, 2, 2) px^2, and which are good.

    image (h, w) of any scale; noise (2,): variance of a pixel = noise[0] + noise[1] times its value;
    clear: share of the way to the next corner within which there is nothing but the crossing.
    """
    half = _window(detected, clear)
    side = np.arange(-half, half + 1)
    dx, dy = (part.ravel() for part in np.meshgrid(side, side))
    rim = half + 1
    inside = np.all((detected >= rim + 1) & (detected <= np.array(image.shape[::-1]) - 2 - rim), axis=1)
    corner = np.where(inside[:, None], detected, rim + 2.0)
    centre = np.rint(corner).astype(np.intp)
    patch = _patches(image, centre, rim)
    gradient = _gradients(patch)
    place = centre[:, None, :] + np.stack([dx, dy], axis=1)[None]
    spread = 0.5 * half
    for _ in range(ROUNDS):
        arm = place - corner[:, None, :]
        weight = np.exp(-0.5 * np.sum(arm**2, axis=2) / spread**2)
        weighted = gradient * weight[:, :, None]
        matrix = np.einsum("npi,npj->nij", weighted, gradient)
        trace = np.trace(matrix, axis1=1, axis2=2)
        sharp = np.linalg.det(matrix) > 1e-4 * trace**2
        matrix[~sharp] = np.eye(2)
        off = np.einsum("npi,npj,npj->ni", weighted, gradient, arm)
        step = np.linalg.solve(matrix, off[:, :, None])[:, :, 0]
        corner = corner + np.where(sharp[:, None], np.clip(step, -1.0, 1.0), 0.0)
        if np.abs(step[sharp]).max(initial=0.0) < 1e-6:
            break
    good = inside & sharp & (np.linalg.norm(corner - detected, axis=1) < STRAYED)
    arm = place - corner[:, None, :]
    crossing = np.einsum("npi,npi->np", gradient, arm)
    pull = matrix - np.einsum("npi,np,npj->nij", weighted, crossing, arm) / spread**2
    pull[~good] = np.eye(2)
    by_gradient = weighted[:, :, :, None] * arm[:, :, None, :] + (weight * crossing)[:, :, None, None] * np.eye(2)
    return corner, _covariances(patch, by_gradient, pull, noise), good


def noise_of(image: Float) -> Float:
    """(2,) a, b of the variance a + b I of a pixel of value I, from the image itself.

    The second differences of flat ground along both axes hold nothing but noise (Immerkaer, 1996); their median by
    levels of brightness, as edges fill the tails only, gives the line.
    """
    kernel = np.array([[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]]) / 6.0
    high = cv2.filter2D(image, cv2.CV_64F, kernel)[1:-1, 1:-1].ravel()
    # of a large image every so many pixels tell as well; an odd number of them, as a colour filter's pattern is even
    step = 2 * (high.size // (2 * ENOUGH)) + 1
    high = high[::step]
    if np.array_equal(image, np.rint(image)):
        # differences of whole numbers are sixths: spread over their sixth, their median is not one of a few values
        high += np.random.default_rng(0).uniform(-1.0 / 12.0, 1.0 / 12.0, high.size)
    high = np.abs(high)
    level = cv2.blur(image, (5, 5))[1:-1, 1:-1].ravel()[::step]
    edges = np.unique(np.quantile(level, np.linspace(0.0, 1.0, 9)))
    group = np.clip(np.searchsorted(edges, level, side="right") - 1, 0, max(len(edges) - 2, 0))
    levels, variances = [], []
    for i in range(max(len(edges) - 1, 1)):
        own = group == i
        if np.count_nonzero(own) > 100:
            levels.append(float(np.median(level[own])))
            variances.append((float(np.median(high[own])) / 0.6745) ** 2)
    if not levels:
        return np.array([1e-12, 0.0])
    slope = 0.0
    if len(levels) > 1 and np.ptp(levels) > 0.0:
        slope = max(float(np.polyfit(levels, variances, 1)[0]), 0.0)
    offset = float(np.median(np.array(variances) - slope * np.array(levels)))
    floor = 1.0 / 12.0 * (1.0 if image.max() > 2.0 else 1.0 / 255.0**2)
    return np.array([max(offset, floor), slope])


def _window(detected: Float, clear: float) -> int:
    """Half side of the surroundings, px: a blurred edge's width less than what is clear."""
    if len(detected) < 2:
        return SMALLEST_WINDOW
    apart = np.linalg.norm(detected[:, None] - detected[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return int(np.clip(clear * np.quantile(apart.min(axis=1), 0.05) - 1.0, SMALLEST_WINDOW, LARGEST_WINDOW))


def _patches(image: Float, centre: np.ndarray, rim: int) -> Float:
    side = np.arange(-rim, rim + 1)
    rows, columns = centre[:, 1, None, None] + side[None, :, None], centre[:, 0, None, None] + side[None, None, :]
    rows, columns = np.clip(rows, 0, image.shape[0] - 1), np.clip(columns, 0, image.shape[1] - 1)
    return np.asarray(image[rows, columns], dtype=np.float64)


def _gradients(patch: Float) -> Float:
    """(n, s, s) -> (n, (s - 2)^2, 2), central differences."""
    gx = 0.5 * (patch[:, 1:-1, 2:] - patch[:, 1:-1, :-2])
    gy = 0.5 * (patch[:, 2:, 1:-1] - patch[:, :-2, 1:-1])
    return np.stack([gx.reshape(len(patch), -1), gy.reshape(len(patch), -1)], axis=2)


def _covariances(patch: Float, by_gradient: Float, pull: Float, noise: Float) -> Float:
    """(n, 2, 2) px^2; by_gradient (n, p, 2, 2): what each gradient's error adds to the sum, pull (n, 2, 2) M."""
    count, side = len(patch), patch.shape[1]
    spread = by_gradient.reshape(count, side - 2, side - 2, 2, 2)
    # the transposed differences take it to the pixels
    influence = np.zeros((count, side, side, 2))
    influence[:, 1:-1, 2:] += 0.5 * spread[..., 0]
    influence[:, 1:-1, :-2] -= 0.5 * spread[..., 0]
    influence[:, 2:, 1:-1] += 0.5 * spread[..., 1]
    influence[:, :-2, 1:-1] -= 0.5 * spread[..., 1]
    variance = np.maximum(noise[0] + noise[1] * patch, 0.5 * noise[0])
    middle = np.einsum("nrci,nrc,nrcj->nij", influence, variance, influence)
    inverse = np.linalg.inv(pull)
    return np.asarray(inverse @ middle @ inverse.transpose(0, 2, 1))
