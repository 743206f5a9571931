"""The joint adjustment: derivatives, truth regained, and the same answer and covariance as scipy's least squares."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.optimize import least_squares

from analysis.calibration.adjust import adjust, bending
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import LENGTHS, normalise, project
from analysis.calibration.observations import Observations, gather
from analysis.calibration.residuals import corners, laser_points
from analysis.calibration.robust import adjust_robustly
from analysis.calibration.start import start
from analysis.calibration.virtual import noisy
from render.base.errors import InputError
from tests.analysis.calibration.boards import LENS, SIZE, truth, views_of


@pytest.mark.parametrize("terms", LENGTHS)
def test_the_lens_is_that_of_opencv(terms: int) -> None:
    rng = np.random.default_rng(terms)
    q = rng.uniform(-0.4, 0.4, (50, 2))
    intrinsics, k = np.array([3000.0, 3100.0, 1200.0, 1000.0]), np.array(LENS[:terms])
    matrix = np.array([[3000.0, 0.0, 1200.0], [0.0, 3100.0, 1000.0], [0.0, 0.0, 1.0]])
    points = np.concatenate([q, np.ones((50, 1))], axis=1)
    seen, jacobian = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, k if terms else np.zeros(5))
    ours, _, by_camera = project(q, intrinsics, k)
    np.testing.assert_allclose(ours, seen[:, 0], atol=1e-9)
    np.testing.assert_allclose(by_camera.reshape(100, -1), jacobian[:, 6 : 10 + terms], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(normalise(ours, intrinsics, k), q, atol=1e-13)


def everything(seen: Observations, estimate: Estimate) -> np.ndarray:
    at_lasers, _ = laser_points(seen, estimate)
    return np.concatenate([corners(seen, estimate).residual, at_lasers.residual])


@pytest.mark.parametrize("terms", [0, 5, 14])
def test_derivatives_are_those_of_finite_differences(terms: int) -> None:
    there = truth(1, 2, terms=terms, lasers=2, warp=(3e-4, -2e-4))
    seen = gather(noisy(views_of(there), np.random.default_rng(2)))
    at_corners, (at_lasers, _) = corners(seen, there), laser_points(seen, there)
    by_shared = np.concatenate([at_corners.by_shared, at_lasers.by_shared])
    for i in range(len(there.shared)):
        step = np.zeros(len(there.shared))
        step[i] = 0.1 / np.abs(by_shared[:, i]).max()
        change = everything(seen, there.with_shared(there.shared + step))
        change = (change - everything(seen, there.with_shared(there.shared - step))) / (2.0 * step[i])
        np.testing.assert_allclose(by_shared[:, i], change, atol=2e-6 * np.abs(change).max())
    by_pose = np.concatenate([at_corners.by_pose, at_lasers.by_pose])
    first = np.concatenate([np.repeat(seen.view, 2) == 0, seen.laser_view == 0])
    for i in range(6):
        step = np.zeros((2, 6))
        step[0, i] = 1e-6
        zero = np.zeros(len(there.shared))
        change = (everything(seen, there.moved(zero, step)) - everything(seen, there.moved(zero, -step))) / 2e-6
        np.testing.assert_allclose(by_pose[first, i], change[first], atol=2e-6 * np.abs(change).max())


@pytest.mark.parametrize("terms", [0, 8])
def test_exact_views_give_the_truth(terms: int) -> None:
    there = truth(3, 14, terms=terms, lasers=3, tilt=(5.0, 45.0), warp=(2e-4, -1e-4))
    wide = np.array([1500.0, 1500.0, 1223.5, 1023.5])  # the terms of a rational lens part only far off the axis
    there = replace(there, intrinsics=wide, translation=there.translation * [2.0, 1.5, 0.5])
    rng = np.random.default_rng(4)
    off = there.moved(rng.normal(size=len(there.shared)) * 1e-3, rng.normal(size=(14, 6)) * 3e-3)
    found = adjust(gather(views_of(there)), off, free_parameters(there, warp=True))
    assert found.converged
    np.testing.assert_allclose(found.estimate.shared, there.shared, rtol=1e-5, atol=1e-7)
    assert found.chi2 < 1e-12


def test_single_points_of_a_laser_are_no_plane() -> None:
    there = truth(3, 6)
    views = [
        replace(view, stripes=tuple(replace(one, pixel=one.pixel[:1], sigma=one.sigma[:1]) for one in view.stripes))
        for view in views_of(there)
    ]
    with pytest.raises(InputError, match="laser 0 on the board are in no plane; found 6 points in 6 views"):
        start(views, SIZE, 0, 1, known=(there.intrinsics, there.distortion))


def test_parameters_and_covariance_are_those_of_scipy() -> None:
    there = truth(5, 5, terms=4, lasers=2)
    seen = gather(noisy(views_of(there, laser_step=64), np.random.default_rng(6)))
    free = free_parameters(there, warp=True)
    found = adjust(seen, there, free)
    best = found.estimate

    def moved(step: np.ndarray) -> np.ndarray:
        return everything(seen, best.moved(step[: len(free)], step[len(free) :].reshape(-1, 6)))

    scale = np.concatenate([np.sqrt(np.diag(found.covariance)), np.full(30, 1e-5)])
    first = np.random.default_rng(7).normal(size=len(scale)) * scale
    other = least_squares(moved, first, x_scale=scale, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    theirs = best.shared + other.x[: len(free)]
    np.testing.assert_allclose(best.shared, theirs, rtol=1e-8, atol=1e-8 * scale[: len(free)].max() + 1e-10)
    scaled = other.jac * scale
    covariance = (
        np.linalg.inv(scaled.T @ scaled)[: len(free), : len(free)] * np.outer(scale, scale)[: len(free), : len(free)]
    )
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        found.covariance / np.outer(spread, spread), covariance / np.outer(spread, spread), atol=1e-6
    )


@pytest.mark.validation
def test_errors_are_as_large_as_told_and_regions_cover() -> None:
    there = truth(8, 8, terms=4, lasers=1, warp=(1e-4, 0.0))
    exact = views_of(there)
    free, rng = free_parameters(there, warp=True), np.random.default_rng(9)
    errors, inside, chi2 = [], 0, []
    for _ in range(200):
        found = adjust(gather(noisy(exact, rng)), there, free)
        error = found.estimate.shared - there.shared
        errors.append(error / np.sqrt(np.diag(found.covariance)))
        inside += error @ np.linalg.solve(found.covariance, error) < 22.362  # 95 % of chi-square with 13 degrees
        chi2.append(found.chi2 / found.freedom)
    # 200 trials of 0.95: standard deviation 1.5 %, of a spread 5 % each and 1.4 % for the mean of 13 correlated ones
    assert 0.90 <= inside / 200 <= 0.995
    ratio = np.sqrt(np.mean(np.square(errors), axis=0))
    assert 0.95 <= ratio.mean() <= 1.05
    assert abs(np.mean(chi2) - 1.0) < 3.0 * np.sqrt(2.0 / found.freedom / 200)


def test_chi_square_rises_by_one_where_errors_are_linear_and_by_far_more_where_a_valley_bends() -> None:
    there = truth(8, 12, terms=5)
    seen = gather(noisy(views_of(there, laser_step=96), np.random.default_rng(1)))
    found = adjust(seen, there, free_parameters(there, warp=True))
    assert bending(seen, found) == pytest.approx(1.0, abs=0.02)
    flat = truth(12, 12, terms=14, tilt=(5.0, 12.0), depth=(0.8, 0.9))
    wide = np.array([1500.0, 1500.0, 1223.5, 1023.5])
    flat = replace(flat, intrinsics=wide, translation=flat.translation * [2.0, 1.5, 0.5])
    seen = gather(noisy(views_of(flat, laser_step=96), np.random.default_rng(1)))
    found = adjust(seen, flat, free_parameters(flat, warp=True))
    assert bending(seen, found) > 2.0


def test_a_rational_lens_settles_where_its_terms_part_and_is_told_by_name_where_they_do_not() -> None:
    narrow = truth(12, 12, terms=14)
    wide = np.array([1500.0, 1500.0, 1223.5, 1023.5])
    near = replace(narrow, intrinsics=wide, translation=narrow.translation * [2.0, 1.5, 0.5])
    rng = np.random.default_rng(12)
    free = free_parameters(near, warp=False)
    found = adjust(gather(noisy(views_of(near, laser_step=96), rng)), near, free)
    assert found.converged
    error = (found.estimate.shared - near.shared)[free] / np.sqrt(np.diag(found.covariance)[free])
    assert np.abs(error).max() < 5.0
    # within 20 deg of the axis numerator and denominator of the radial term cancel
    with pytest.raises(InputError, match=r"mixture of k\d, k\d, k\d"):
        adjust_robustly(gather(noisy(views_of(narrow, laser_step=96), rng)), narrow, free)
