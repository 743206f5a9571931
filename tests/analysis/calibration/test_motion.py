"""Boards that a stage, a turntable or a robot's hand carried: derivatives, scipy's answer, and errors as told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from analysis.calibration.adjust import adjust
from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.motion import Kind, Motion, Told, started
from analysis.calibration.observations import gather
from analysis.calibration.residuals import corners, laser_points
from analysis.calibration.virtual import noisy
from render.base.errors import InputError
from tests.analysis.calibration.boards import SIZE, target, truth, views_of

KINDS: tuple[Kind, ...] = ("stage", "turntable", "hand_eye")
STAGE_FIRST = ["stage", *(pytest.param(kind, marks=pytest.mark.validation) for kind in KINDS[1:])]
PLACED = 4
"""Views of each of the two placements; the others are free."""


def motion_of(kind: Kind, views: int, rng: np.random.Generator) -> Motion:
    group = np.concatenate([np.zeros(PLACED), np.ones(PLACED), 2 + np.arange(views - 2 * PLACED)]).astype(np.intp)
    along = np.array([0.0, -1.0, 0.0])
    if kind == "stage":
        given = np.where(group < 2, rng.uniform(-0.05, 0.05, views), 0.0)
        return Motion(kind, group, given, np.array([0.3, 0.9, 0.31]), along)
    if kind == "turntable":
        given = np.where(group < 2, rng.uniform(-0.5, 0.5, views), 0.0)
        return Motion(kind, group, given, np.array([0.05, -0.2, 0.03, 0.9]), along)
    hand = np.tile(np.eye(4), (views, 1, 1))
    hand[:, :3, :3] = Rotation.from_rotvec(rng.normal(size=(views, 3)) * 0.08).as_matrix()
    hand[:, :3, 3] = [0.4, 0.1, 0.6] + rng.normal(size=(views, 3)) * 0.03
    return Motion(kind, group, hand, np.array([0.4, -1.1, 0.7, 0.05, -0.02, 0.08]), along)


def carried(kind: Kind, *, views: int = 12, terms: int = 4, lasers: int = 1, seed: int = 3) -> Estimate:
    there = truth(seed, views, terms=terms, lasers=lasers, tilt=(10.0, 35.0), warp=(1e-4, -5e-5))
    there = replace(there, motion=motion_of(kind, views, np.random.default_rng(seed)))
    return there.moved(np.zeros(len(there.shared)), np.zeros((views - 2 * PLACED + 2, 6)))


def everything(seen, estimate: Estimate) -> np.ndarray:
    return np.concatenate([corners(seen, estimate).residual, laser_points(seen, estimate)[0].residual])


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_finite_differences(kind: Kind) -> None:
    there = carried(kind)
    seen = gather(noisy(views_of(there, laser_step=64), np.random.default_rng(2)))
    lines = laser_points(seen, there)[0]
    at = corners(seen, there)
    by_shared, by_pose = (np.concatenate([getattr(each, n) for each in (at, lines)]) for n in ("by_shared", "by_pose"))
    own = there.motion_slice
    for i in range(own.start, own.stop):
        step = np.zeros(len(there.shared))
        step[i] = 0.1 / np.abs(by_shared[:, i]).max()
        change = everything(seen, there.with_shared(there.shared + step))
        change = (change - everything(seen, there.with_shared(there.shared - step))) / (2.0 * step[i])
        np.testing.assert_allclose(by_shared[:, i], change, atol=2e-6 * np.abs(change).max())
    second = np.concatenate([there.group[np.repeat(seen.view, 2)] == 1, there.group[seen.laser_view] == 1])
    zero = np.zeros(len(there.shared))
    for i in range(6):
        step = np.zeros((len(there.motion.first), 6))
        step[1, i] = 1e-6
        change = (everything(seen, there.moved(zero, step)) - everything(seen, there.moved(zero, -step))) / 2e-6
        np.testing.assert_allclose(by_pose[second, i], change[second], atol=2e-6 * np.abs(change).max())
        assert np.abs(change[~second]).max() == 0.0


@pytest.mark.parametrize("kind", STAGE_FIRST)
def test_parameters_and_covariance_are_those_of_scipy(kind: Kind) -> None:
    there = carried(kind, views=9)
    seen = gather(noisy(views_of(there, laser_step=128), np.random.default_rng(6)))
    free = free_parameters(there, warp=True)
    found = adjust(seen, there, free)
    best, count = found.estimate, len(free)

    scale = np.concatenate([np.sqrt(np.diag(found.covariance)), np.full(6 * len(there.motion.first), 1e-5)])

    def moved(x: np.ndarray) -> np.ndarray:
        step = (x - 10.0) * scale  # in standard deviations from 10, so that differences are taken over a hundredth
        return everything(seen, best.moved(step[:count], step[count:].reshape(-1, 6)))

    first = 10.0 + np.random.default_rng(7).normal(size=len(scale))
    other = least_squares(moved, first, jac="3-point", diff_step=1e-3, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    # its steps end where rounding decides whether the cost falls: a last one by its own derivatives
    last = other.x - np.linalg.lstsq(other.jac, other.fun, rcond=None)[0]
    off = np.abs((last - 10.0) * scale)[:count]
    assert np.all(off <= np.maximum(1e-8 * np.abs(best.shared), 1e-6 * scale[:count]))
    theirs = np.linalg.inv(other.jac.T @ other.jac)[:count, :count]
    covariance = theirs * np.outer(scale, scale)[:count, :count]
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        found.covariance / np.outer(spread, spread), covariance / np.outer(spread, spread), atol=1e-6
    )


@pytest.mark.parametrize("kind", STAGE_FIRST)
def test_the_motion_is_found_from_the_views_alone_and_errs_as_it_tells(kind: Kind) -> None:
    there = carried(kind, views=14)
    motion = there.motion
    by_name = {f"view {i}": (str(motion.group[i]), motion.given[i]) for i in range(2 * PLACED)}
    exact, squared = views_of(there, laser_step=64), []
    exact[2] = replace(exact[2], target=-exact[2].target)  # a checkerboard is the same from either end
    for seed in range(5):
        views = noisy(exact, np.random.default_rng(seed))
        found = calibrate(views, target(), Request(SIZE, 1, 4, told=Told(kind, by_name)))
        own, covariance = there.motion_slice, found.adjusted.solution.covariance
        error = found.estimate.shared[own] - there.shared[own]
        squared.append(error @ np.linalg.solve(covariance[own, own], error))
        assert found.adjusted.left_out == ()
        assert found.adjusted.corner_scale < 1.1
    # a sum of five chi-squares of so many degrees, within 4 standard deviations
    degrees = 5 * (own.stop - own.start)
    assert abs(sum(squared) - degrees) < 4.0 * np.sqrt(2.0 * degrees)


def test_an_axis_lessens_the_camera_s_errors() -> None:
    there = carried("turntable", views=8, terms=0)
    seen = gather(views_of(there, laser_step=64))
    with_axis = adjust(seen, there, free_parameters(there, warp=True))
    free = replace(there, motion=None)
    without = adjust(seen, free, free_parameters(free, warp=True))
    count = len(free.shared)
    gain = np.diag(with_axis.covariance)[:count] / np.diag(without.covariance)
    assert np.all(gain < 1.0 + 1e-9) and gain[:4].min() < 0.8


def test_a_view_whose_position_was_told_wrongly_is_named() -> None:
    there = carried("stage", views=14)
    motion = there.motion
    by_name = {f"view {i}": (str(motion.group[i]), motion.given[i]) for i in range(2 * PLACED)}
    by_name["view 2"] = ("0", motion.given[2] + 0.004)
    views = noisy(views_of(there, laser_step=64), np.random.default_rng(1))
    found = calibrate(views, target(), Request(SIZE, 1, 4, told=Told("stage", by_name)))
    assert len(found.adjusted.left_out) == 1 and found.adjusted.left_out[0].startswith("view 2: its corners are")


@pytest.mark.parametrize("kind", STAGE_FIRST)
def test_a_moved_focus_is_named_where_boards_were_carried(kind: Kind) -> None:
    there = carried(kind, views=14)
    motion = there.motion
    by_name = {f"view {i}": (str(motion.group[i]), motion.given[i]) for i in range(2 * PLACED)}
    refocused = replace(there, intrinsics=there.intrinsics * [1.004, 1.004, 1.0, 1.0])
    views = noisy(views_of(there, laser_step=64), np.random.default_rng(1))
    odd = {6, 7}
    for i, view in enumerate(noisy(views_of(refocused, laser_step=64), np.random.default_rng(2))):
        views[i] = view if i in odd else views[i]
    found = calibrate(views, target(), Request(SIZE, 1, 4, told=Told(kind, by_name)))
    named = {text.split(":")[0] for text in found.adjusted.left_out if "focal length is longer" in text}
    assert named == {f"view {i}" for i in odd}


def test_motions_that_show_nothing_are_refused() -> None:
    there = carried("hand_eye")
    motion = there.motion
    given = np.tile(np.eye(4), (12, 1, 1))
    given[:, :3, :3] = Rotation.from_rotvec(np.linspace(0.0, 0.8, 12)[:, None] * [[0.0, 0.0, 1.0]]).as_matrix()
    with pytest.raises(InputError, match="about one axis only"):
        started("hand_eye", motion.group, given, there.rotation, there.translation)
    with pytest.raises(InputError, match="stage did not move"):
        started("stage", motion.group, np.zeros(12), there.rotation, there.translation)
    with pytest.raises(InputError, match="turntable did not turn"):
        started("turntable", motion.group, np.zeros(12), there.rotation, there.translation)
    with pytest.raises(InputError, match="no two views of one placement"):
        Told("stage", {"a": ("0", np.zeros(()))}).of(["a", "b", "c"])
