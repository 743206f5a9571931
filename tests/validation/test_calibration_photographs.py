"""A scanner calibrated by 38 photographs of 2448 x 2048 pixels with noise, drawn by the camera's equations; and 30
times by 12 such photographs, which errs as it tells.

python -m tests.validation.test_calibration_photographs 3    # a table, of as many draws of poses and noise
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from scipy import stats
from scipy.special import erf

from analysis.calibration.board import Board
from analysis.calibration.calibrate import Calibrated, Request, calibrate
from analysis.calibration.detect import detect
from analysis.calibration.estimate import Estimate, unit_plane
from analysis.calibration.lens import normalise
from analysis.calibration.observations import View
from analysis.calibration.virtual import exact_view, noisy
from studio.calibration.in_silico import true_depth_error
from tests.analysis.calibration.boards import SIZE, SQUARE, target, truth

pytestmark = pytest.mark.validation

BOARD = Board("checkerboard", 13, 9, SQUARE)
VIEWS, BLUR, AROUND = 38, 0.8, 60
TRIALS, FEWER = 30, 12
DARK, BRIGHT, FULL_WELL = 60.0, 170.0, 10_000.0
"""Digital numbers of 255, and the electrons that 255 is of."""


@dataclass(frozen=True)
class Outcome:
    """rms px of corners per coordinate, normal's error mrad, principal point's px, and corners' chi-square a degree."""

    reprojection: float
    normal: float
    centre: float
    chi2: float
    depth: tuple[float, float]
    """m, true and told."""


@cache
def directions() -> np.ndarray:
    """(2048, 2448, 3) of the pixels: the camera is the same in all scanners of `truth`."""
    there = truth(0, 1, terms=5)
    u, v = np.meshgrid(*(np.arange(n, dtype=np.float64) for n in SIZE))
    q = normalise(np.column_stack([u.ravel(), v.ravel()]), there.intrinsics, there.distortion)
    return np.dstack([q.reshape(*u.shape, 2), np.ones(u.shape)])


def photograph(there: Estimate, number: int, rng: np.random.Generator) -> np.ndarray:
    """(2048, 2448) 8 bit, a checkerboard with a white margin, blurred before it is sampled: nothing is aliased."""
    out = np.full((SIZE[1], SIZE[0]), BRIGHT)
    corners = exact_view("", there, number, target() * [7.0 / 6.0, 5.0 / 4.0], SIZE).pixel
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - AROUND, 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + AROUND, SIZE)
    rays = directions()[low[1] : high[1], low[0] : high[0]]
    rotation, translation = there.rotation[number], there.translation[number]
    depth = (rotation[:, 2] @ translation) / (rays @ rotation[:, 2])
    x, y = ((depth * (rays @ rotation[:, i]) - translation @ rotation[:, i]) / SQUARE for i in (0, 1))
    sign = np.ones(x.shape)
    for each, end in ((x, 6.0), (y, 4.0)):
        width = np.hypot(*np.gradient(each))
        nearest = np.clip(np.rint(each), -end, end)
        side = np.where((nearest + end) % 2 == 0, 1.0, -1.0)
        sign *= side * erf((each - nearest) / width / (np.sqrt(2.0) * BLUR))
    inside = (np.abs(x) < 7.0) & (np.abs(y) < 5.0)
    light = np.where(inside, 0.5 * (DARK + BRIGHT) - 0.5 * (BRIGHT - DARK) * sign, BRIGHT)
    out[low[1] : high[1], low[0] : high[0]] = light
    drawn = out + rng.normal(size=out.shape) * np.sqrt(0.3 + out * 255.0 / FULL_WELL)
    return np.asarray(np.clip(np.rint(drawn), 0, 255), dtype=np.uint8)


def calibrated(seed: int, count: int = VIEWS) -> tuple[Calibrated, Estimate, np.ndarray]:
    """From so many photographs, beside the truth, and chi-square of each corner."""
    there, rng = truth(seed, count, terms=5), np.random.default_rng(seed)
    views, chi2 = [], []
    for number in range(count):
        seen, _ = detect(photograph(there, number, rng), BOARD, f"view {number}")
        exact = exact_view(seen.name, there, number, target(), SIZE)
        shifted = seen.target - [6 * SQUARE, 4 * SQUARE]
        first = exact.pixel[np.argmin(np.linalg.norm(exact.target - shifted[0], axis=1))]
        shifted = shifted if np.linalg.norm(first - seen.pixel[0]) < 3.0 else -shifted
        order = [int(np.argmin(np.linalg.norm(exact.target - one, axis=1))) for one in shifted]
        error = seen.pixel - exact.pixel[order]
        chi2.append(np.einsum("ni,nij,nj->n", error, np.linalg.inv(seen.covariance), error))
        stripes = noisy([exact], rng)[0].stripes
        views.append(View(seen.name, seen.pixel, seen.covariance, shifted, stripes))
    found = calibrate(views, target(), Request(SIZE, 1, 5, nearest=0.7, farthest=1.0))
    return found, there, np.concatenate(chi2)


def outcome(seed: int) -> Outcome:
    found, there, chi2 = calibrated(seed)
    estimate, adjusted = found.estimate, found.adjusted
    used = adjusted.seen.whitening[:, 0, 0] > 0.0
    white = adjusted.solution.corner_residual[used]
    pixel = np.linalg.solve(adjusted.seen.whitening[used], white[:, :, None])[:, :, 0]
    normals = [unit_plane(each.planes[0])[:3] for each in (estimate, there)]
    return Outcome(
        float(np.sqrt(np.mean(pixel**2))),
        1e3 * float(np.linalg.norm(np.cross(*normals))),
        float(np.abs(estimate.intrinsics[2:] - there.intrinsics[2:]).max()),
        float(chi2.mean()) / 2.0,
        true_depth_error(found, there)[0],
    )


def squared_errors(seed: int) -> tuple[float, float]:
    """Chi-square of the intrinsics, of 4 degrees, and of the plane, of 3, by the covariance told; of FEWER views."""
    found, there, _ = calibrated(seed, FEWER)
    out = []
    for part in (slice(0, 4), there.plane_slice(0)):
        error = found.estimate.shared[part] - there.shared[part]
        out.append(float(error @ np.linalg.solve(found.adjusted.solution.covariance[part, part], error)))
    return out[0], out[1]


def test_30_sets_of_photographs_err_as_they_tell() -> None:
    for values, degrees in zip(zip(*map(squared_errors, range(TRIALS)), strict=True), (4, 3), strict=True):
        low, high = stats.chi2.ppf([0.0005, 0.9995], degrees * TRIALS)
        assert low < sum(values) < high, values
        # as many of 30 outside the 95 % region as a binomial has with a probability of 99.9 %
        outside = sum(value > stats.chi2.ppf(0.95, degrees) for value in values)
        assert outside <= stats.binom.ppf(0.999, TRIALS, 0.05)


def test_38_photographs_reach_the_noise() -> None:
    found = outcome(0)
    assert found.reprojection <= 0.02 and found.normal <= 0.03 and found.centre <= 0.1
    assert 0.9 <= found.chi2 <= 1.1
    assert found.depth[0] < 2.5 * found.depth[1]


if __name__ == "__main__":
    for each in range(int(sys.argv[1])):
        print(each, outcome(each), flush=True)
