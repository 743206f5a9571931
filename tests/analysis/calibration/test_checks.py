"""A calibration tells what is wrong with it: wrong views, a wrong lens, sets of views that cannot do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from analysis.calibration import robust
from analysis.calibration.adjust import Prior, adjust, view_information
from analysis.calibration.calibrate import Request, calibrate
from analysis.calibration.checks import Halves, halves, whiteness
from analysis.calibration.degenerate import complaints
from analysis.calibration.depth import depth_error, depth_jacobian, working_volume
from analysis.calibration.estimate import Estimate, free_parameters
from analysis.calibration.lens import normalise
from analysis.calibration.next_pose import advise
from analysis.calibration.observations import View, gather
from analysis.calibration.robust import Adjusted, adjust_robustly
from analysis.calibration.virtual import exact_view, noisy
from render.base.errors import InputError
from tests.analysis.calibration.boards import DEGENERATE, SIZE, degenerate, target, truth, views_of

EXTENT = target()


def adjusted(there: Estimate, views: list[View]) -> Adjusted:
    return adjust_robustly(gather(views, EXTENT), there, free_parameters(there, warp=True))


def test_a_wrong_line_a_bad_view_and_stray_corners_are_left_out_by_name() -> None:
    there = truth(1, 12, terms=4)
    views = noisy(views_of(there), np.random.default_rng(1))
    views[2].stripes[0].pixel[:, 0] += 8.0
    moved = views[5].pixel + np.random.default_rng(2).normal(size=views[5].pixel.shape) * 3.0
    views[5] = replace(views[5], pixel=moved)
    views[7].pixel[3] += [2.0, -1.0]
    found = adjusted(there, views)
    told = "\n".join(found.left_out)
    assert "view 2: the line of laser 0" in told and "view 5: its corners" in told and "view 7: 1 stray" in told
    error = found.solution.estimate.shared - there.shared
    sigma = np.sqrt(np.diag(found.solution.covariance))
    assert np.all(np.abs(error) < 4.5 * sigma)
    assert found.corner_scale < 1.1 and found.laser_scale < 1.1


@pytest.mark.parametrize("seeds", [range(5), pytest.param(range(5, 30), marks=pytest.mark.validation)])
def test_a_line_of_one_or_two_points_is_left_out_for_what_noise_does_not_make(seeds: range) -> None:
    there = truth(1, 12)
    exact = views_of(there, laser_step=64)
    blamed = []
    for seed in seeds:
        views = noisy(exact, np.random.default_rng(seed))
        for i, view in enumerate(views):
            few = slice(0, 1 + i % 2)
            stripes = [replace(one, pixel=one.pixel[few].copy(), sigma=one.sigma[few]) for one in view.stripes]
            views[i] = replace(view, stripes=tuple(stripes))
        blamed += [text for text in adjusted(there, views).left_out if "laser 0" in text]
        views[4].stripes[0].pixel[:, 0] += 3.0
        assert any(text.startswith("view 4: the line of laser 0") for text in adjusted(there, views).left_out)
    assert blamed == []


def test_clean_views_lose_nothing() -> None:
    there = truth(2, 12, terms=4, lasers=2)
    assert adjusted(there, noisy(views_of(there), np.random.default_rng(3))).left_out == ()


def volume_error(there: Estimate, found: Estimate) -> tuple[float, np.ndarray]:
    volume = working_volume(there, 0, SIZE, 0.7, 1.0)
    depths = []
    for one in (there, found):
        q = normalise(volume.pixel, one.intrinsics, one.distortion)
        depths.append(1.0 / (q @ one.planes[0][:2] + one.planes[0][2]))
    return float(np.mean((depths[1] - depths[0]) ** 2)), depths[0]


def test_depth_errs_as_is_told() -> None:
    there = truth(4, 6, terms=4)
    exact, rng = views_of(there, laser_step=64), np.random.default_rng(5)
    free, squares, told = free_parameters(there, warp=False), [], []
    volume = working_volume(there, 0, SIZE, 0.7, 1.0)
    q = normalise(volume.pixel, there.intrinsics, there.distortion)
    jacobian = depth_jacobian(there, volume, q)
    first = adjust(gather(exact, EXTENT), there, free)
    for _ in range(60):
        found = adjust(gather(noisy(exact, rng), EXTENT), there, free)
        squares.append(volume_error(there, found.estimate)[0])
        told.append(depth_error(found.estimate, found.covariance, volume, 0.05).rms)
    # a sum of few chi-square variables: of the mean of 60 the spread is worked out
    variances = np.linalg.eigvalsh(jacobian @ first.covariance @ jacobian.T / len(q))
    spread = np.sqrt(2.0 * np.sum(variances**2) / 60) / variances.sum()
    assert abs(np.mean(squares) / np.mean(np.square(told)) - 1.0) < 3.0 * spread


def bent(there: Estimate, views: list[View], pixels: float) -> list[View]:
    """The same seen through a lens that bends the image by so many px at its edge, along a wave no model has."""
    out = []
    for view in views:
        x = (view.pixel - there.intrinsics[2:]) / 1224.0
        wave = pixels * np.column_stack([np.sin(4.0 * x[:, 1]), np.sin(4.0 * x[:, 0])])
        out.append(replace(view, pixel=view.pixel + wave))
    return out


@pytest.mark.validation
def test_a_lens_that_is_not_as_modelled_is_told_and_a_good_one_is_not() -> None:
    alarms, missed, p_halves, p_white = 0, 0, [], []
    for seed in range(12):
        there = truth(seed, 20)
        exact = [exact_view(f"view {i}", there, i, target(), SIZE, laser_step=128) for i in range(20)]
        rng = np.random.default_rng(100 + seed)
        good = adjusted(there, noisy(exact, rng))
        p_white.append(whiteness(good).p)
        alarms += p_white[-1] < 0.05
        pair = halves(good, [working_volume(there, 0, SIZE, 0.7, 1.0)])
        assert pair is not None
        p_halves.append(pair.p)
        missed += whiteness(adjusted(there, noisy(bent(there, exact, 0.1), rng))).p >= 0.05
    assert alarms <= 3 and missed == 0  # of 12 at 5 %: four or more come once in 500
    for p in (p_halves, p_white):  # uniform: the mean of 12 has a standard deviation of 0.083
        assert np.min(p) > 1e-3 and 0.25 < np.mean(p) < 0.75


@pytest.mark.parametrize(("given", "sentence"), DEGENERATE)
def test_each_degenerate_set_has_its_sentence(given: dict[str, Any], sentence: str) -> None:
    there = degenerate(0, **given)
    assert any(sentence in one for one in complaints(views_of(there, laser_step=32), there, SIZE))


@pytest.mark.parametrize("seeds", [range(20), pytest.param(range(20, 200), marks=pytest.mark.validation)])
def test_of_200_good_sets_none_is_blamed(seeds: range) -> None:
    blamed = []
    for seed in seeds:
        there = truth(seed, 12)
        views = [exact_view(f"view {i}", there, i, target(), SIZE, laser_step=24) for i in range(12)]
        blamed += complaints(views, there, SIZE)
    assert blamed == []


def test_the_advised_pose_gains_what_was_told_and_more_than_chance() -> None:
    there = truth(9, 6, terms=4)
    views = views_of(there)
    free = free_parameters(there, warp=True)
    volumes = [working_volume(there, 0, SIZE, 0.7, 1.0)]
    first = adjust(gather(views, EXTENT), there, free)
    told = advise(there, first.information, free, target(), SIZE, volumes, sigmas=(0.05, 0.05))
    assert told.before == pytest.approx(depth_error(there, first.covariance, volumes[0], 0.05).rms, rel=1e-6)

    def after(pose: Estimate) -> float:
        more = exact_view("next", pose, len(pose.rotation) - 1, target(), SIZE)
        both = adjust(gather([*views, more], EXTENT), pose, free)
        return depth_error(there, both.covariance, volumes[0], 0.05).rms

    def with_pose(rotation: np.ndarray, translation: np.ndarray) -> Estimate:
        return replace(
            there,
            rotation=np.concatenate([there.rotation, rotation[None]]),
            translation=np.concatenate([there.translation, translation[None]]),
        )

    reached = after(with_pose(told.rotation, told.centre))
    assert reached == pytest.approx(told.after, rel=0.15)
    others = truth(10, 8)
    by_chance = [after(with_pose(others.rotation[i], others.translation[i])) for i in range(8)]
    assert reached < np.min(by_chance)


def test_the_origin_of_a_board_in_its_corner_hides_no_fault() -> None:
    """A tilted board's corner is nearer or farther than its middle, which is what stays at one distance."""
    there = truth(3, 20, tilt=(5.0, 40.0), depth=(0.85, 0.86))
    corner = target().min(axis=0)
    moved = replace(there, translation=there.translation + there.rotation[:, :, :2] @ corner)
    views = [replace(view, target=view.target - corner) for view in views_of(there, laser_step=32)]
    assert complaints(views, moved, SIZE) == complaints(views_of(there, laser_step=32), there, SIZE)
    assert any("one distance" in one for one in complaints(views, moved, SIZE))


def test_the_lines_own_error_is_that_along_its_scan_lines() -> None:
    """A laser that lies, measured along columns, in a camera turned by a quarter: the same numbers."""
    there = truth(3, 5)
    lying = replace(there, planes=there.planes[:, [1, 0, 2]], intrinsics=there.intrinsics[[1, 0, 3, 2]])
    gains = []
    for one, size in ((there, SIZE), (lying, SIZE[::-1])):
        volume = working_volume(one, 0, size, 0.7, 1.0)
        gains.append(depth_error(one, np.zeros((len(one.shared),) * 2), volume, 0.1).random)
    np.testing.assert_allclose(gains[1], gains[0], rtol=1e-9)


@pytest.mark.validation
def test_halves_of_a_known_camera_differ_by_what_the_views_alone_tell() -> None:
    """The camera that both hold to is no part of the difference, however uncertain it is."""
    there = truth(4, 8)
    exact, rng, p = views_of(there, laser_step=128), np.random.default_rng(6), []
    free = free_parameters(there, warp=True)
    first = adjust(gather(exact, EXTENT), there, free)
    camera = np.zeros(len(there.shared), dtype=bool)
    camera[: there.camera_count] = True
    information = np.where(np.outer(camera, camera), 4.0 * first.information, 0.0)
    for _ in range(40):
        found = adjust_robustly(gather(noisy(exact, rng), EXTENT), there, free, Prior(there.shared, information))
        pair = halves(found, [working_volume(there, 0, SIZE, 0.7, 1.0)], Prior(there.shared, information))
        assert pair is not None
        p.append(pair.p)
    # uniform: mean 0.5, of 40 with a standard deviation of 0.046
    assert abs(np.mean(p) - 0.5) < 0.14


def test_an_adjustment_that_does_not_settle_gives_no_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    there = truth(2, 6)
    seen = gather(noisy(views_of(there, laser_step=64), np.random.default_rng(3)), EXTENT)
    monkeypatch.setattr(robust, "adjust", lambda *given, **more: replace(adjust(*given, **more), converged=False))
    with pytest.raises(InputError, match="does not settle"):
        adjust_robustly(seen, there, free_parameters(there, warp=True))


def test_steps_at_the_level_of_rounding_are_an_end() -> None:
    there = truth(1, 12, terms=5, warp=(1e-4, 0.0))
    exact, rng = views_of(there, laser_step=64), np.random.default_rng(1)
    for _ in range(6):
        assert adjust(gather(noisy(exact, rng), EXTENT), there, free_parameters(there, warp=True)).converged


def test_information_of_views_adds_up_to_that_of_all() -> None:
    there = truth(11, 5, lasers=2)
    seen = gather(views_of(there), EXTENT)
    whole = adjust(seen, there, free_parameters(there, warp=True)).information
    np.testing.assert_allclose(view_information(seen, there).sum(axis=0), whole, atol=1e-6 * np.abs(whole).max())


def test_views_that_leave_their_poses_open_tell_nothing_and_are_no_fault() -> None:
    """A place for the next board may have a single corner in the image: no calibration must end there."""
    there = truth(1, 24, lasers=1)
    seen = gather(views_of(there), EXTENT)
    alone = np.isin(np.arange(len(seen.view)), np.searchsorted(seen.view, np.arange(seen.count)) + 3)
    single = replace(seen, whitening=8.0 * seen.whitening * alone[:, None, None], laser_weight=0.0 * seen.laser_weight)
    told, whole = view_information(single, there), view_information(seen, there)
    assert np.abs(told).max() < 1e-3 * np.abs(whole).max()


def test_the_whole_way_tells_what_to_photograph_where_nothing_can_be_found() -> None:
    there = truth(12, 20, tilt=(0.0, 0.5), depth=(0.85, 0.851), lasers=1)
    views = noisy(views_of(there, laser_step=64), np.random.default_rng(13))
    try:
        found = calibrate(views, target(), Request(SIZE, 1, 5))
    except Exception as error:  # either way it is told what to photograph
        assert "tilted" in str(error)
    else:
        assert any("tilted by 20 to 40 deg" in one for one in found.faults)


def test_the_chance_is_told_of_all_parameters_and_not_of_the_depths_beside_it() -> None:
    agreed, differing = Halves(8e-6, 81e-6, 0.57).sentence, Halves(81e-6, 8e-6, 1e-5).sentence
    assert "8 um apart, where their noise explains 81 um; by chance all their parameters together" in agreed
    assert agreed.endswith("at least as much in 57% of such calibrations")
    assert "but in 0.001 % of such calibrations; in depth they are 81 um apart, where noise explains 8 um" in differing
