"""Dimensions of exact profiles are exact, and those of noisy ones as uncertain as their sigma says."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from analysis.gauges.gauge import MOST_GAUGES, REGIONS
from analysis.gauges.outline import outline
from analysis.gauges.read import read
from tests.analysis.gauges.profiles import ACROSS, KINDS, PITCH, REGION, gauge, noises, profile, shape


@pytest.mark.parametrize("kind", KINDS)
def test_an_exact_profile_gives_the_closed_form(kind: str) -> None:
    height, exact = shape(kind)
    reading = read(gauge(kind), 0, profile(height), profile(height))

    assert reading.value == pytest.approx(exact, rel=1e-7)
    assert reading.error == 0.0 and reading.sigma > 0.0


@pytest.mark.parametrize("trials", [60, pytest.param(400, marks=pytest.mark.validation)])
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "edge_to_edge"])
def test_sigma_covers_and_nothing_is_biased(kind: str, trials: int) -> None:
    """Half of the profiles have noise that neighbours share."""
    height, exact = shape(kind)
    told = []
    for length in (1.0, 5.0):
        for noise in noises(trials // 2, length, seed=7):
            reading = read(gauge(kind), 0, profile(height, length=length, noise=noise), None)
            told.append((reading.value - exact) / reading.sigma)
    low, high = binom.ppf([0.0005, 0.9995], trials, 0.9545)
    assert low <= np.count_nonzero(np.abs(told) <= 2.0) <= high
    assert abs(np.mean(told)) < 3.3 / np.sqrt(trials)


@pytest.mark.parametrize("kind", ["step", "radius", "angle"])
def test_points_on_the_ends_of_a_region_bias_nothing(kind: str) -> None:
    """200 parts, half of them with the noise of the others mirrored, so that what is odd in it leaves the mean.

    Of a point on a hard end only noise towards the region would be seen: a step was off by 0.29 sigma for it.
    """
    height, exact = shape(kind)
    ends = tuple((low - 0.5 * PITCH, high + 0.5 * PITCH) for low, high in REGION[kind])
    asked = gauge(kind).model_copy(update={"regions": ends})
    told = []
    for length in (1.0, 5.0):
        drawn = noises(50, length, seed=11)
        for noise in (*drawn, *-drawn):
            reading = read(asked, 0, profile(height, length=length, noise=noise), None)
            told.append((reading.value - exact) / reading.sigma)
    assert abs(np.mean(told)) < 0.1
    assert 0.93 <= np.mean(np.abs(told) <= 2.0) <= 0.97


@pytest.mark.parametrize("kind", ["step", "angle"])
def test_neighbours_that_err_alike_make_sigma_the_root_of_their_number(kind: str) -> None:
    height, _ = shape(kind)
    alone, alike = (read(gauge(kind), 0, profile(height, length=length), None).sigma for length in (1.0, 4.0))
    # 4 scan lines that err as one make a mean's sigma twice as large; near the ends of a region a little less
    assert 1.8 < alike / alone < 2.0


def test_what_moves_all_points_alike_moves_a_height_only_by_what_tells_them_apart() -> None:
    """A scale error of 1e-3 in height, and a shift: the step feels the first alone, the bow neither."""
    height, exact = shape("step")
    shift, scale = np.zeros((2, len(height), 2))
    shift[:, 1], scale[:, 1] = 1e-3, 1e-3 * (height + 0.5 - 0.1 * ACROSS)
    shared = np.stack([shift, scale], axis=2)
    reading = read(gauge("step"), 0, profile(height, systematic=shared), None)
    assert reading.sigma_systematic == pytest.approx(1e-3 * exact, rel=1e-6)
    flat = read(gauge("straightness"), 0, profile(0.0 * ACROSS, systematic=shared[:, :, :1]), None)
    assert flat.sigma_systematic < 1e-15


def test_a_few_wild_points_are_left_out() -> None:
    height, exact = shape("step")
    noise = noises(1, 1.0, seed=3)[0]
    clean = read(gauge("step"), 0, profile(height, noise=noise), None)
    noise[[40, 45, 150]] += 500.0
    reading = read(gauge("step"), 0, profile(height, noise=noise), None)
    assert abs(reading.value - exact) < 4.0 * reading.sigma
    assert reading.points == clean.points - 3


@pytest.mark.parametrize("kind", ["step", "angle", "v_depth"])
def test_a_region_that_reaches_over_an_edge_says_how_many_points_are_left_out(kind: str) -> None:
    """A step with a V in its upper side was -0.3 um without a word of the 150 points of 700 that its flanks are."""
    height, exact = shape(kind)
    noise = noises(1, 1.0, seed=5)[0]
    assert not read(gauge(kind), 0, profile(height, noise=noise), None).remark
    points = profile(height, noise=noise)
    there = np.flatnonzero(points.weight(*REGION[kind][1]) > 0.0)
    over = there[: len(there) // 5]
    points.position[over, 1] -= np.linspace(0.1, 0.5, len(over))
    reading = read(gauge(kind), 0, points, None)
    assert abs(reading.value - exact) < 4.0 * reading.sigma
    told = f" of the {len(there)} points in the region '{REGIONS[kind][1]}' are far off its curve and are left out"
    assert told in reading.remark
    # noise may leave out one more
    assert len(over) <= int(reading.remark.split(told)[0]) <= len(over) + 1


@pytest.mark.parametrize(("share", "verdict"), [(0.2, "pass"), (0.4, "undecided")])
def test_a_curve_that_leaves_out_more_than_a_third_proves_nothing(share: float, verdict: str) -> None:
    height, exact = shape("step")
    points = profile(height, noise=noises(1, 1.0, seed=5)[0])
    there = np.flatnonzero(points.weight(*REGION["step"][1]) > 0.0)
    over = there[: round(share * len(there))]
    points.position[over, 1] -= np.linspace(0.1, 0.5, len(over))
    limits = {"nominal": exact, "lower": -1e-3, "upper": 1e-3}
    assert read(gauge("step").model_copy(update=limits), 0, points, None).verdict == verdict


@pytest.mark.parametrize("kind", ["width", "opening", "v_depth", "gap"])
def test_a_left_region_on_the_right_is_told(kind: str) -> None:
    height, _ = shape(kind)
    good = gauge(kind)
    swapped = good.model_copy(update={"regions": (*good.regions[:-2], good.regions[-1], good.regions[-2])})
    assert "lies on the right of" in read(swapped, 0, profile(height), None).remark


@pytest.mark.parametrize("kind", ["radius", "straightness", "angle", "step", "gap"])
@pytest.mark.parametrize("place", [0, 3])
def test_a_false_point_far_off_draws_nothing_to_it(kind: str, place: int) -> None:
    """At the end of a region, where it has most say: a circle that took one in was three times too large."""
    height, exact = shape(kind)
    points = profile(height, noise=noises(1, 1.0, seed=5)[0])
    last = np.flatnonzero(points.weight(*REGION[kind][0]) > 0.0)[-1 - place]
    points.position[last, 1] += 0.166
    reading = read(gauge(kind), 0, points, None)
    assert abs(reading.value - exact) < 4.0 * reading.sigma
    assert reading.sigma < 1.5 * read(gauge(kind), 0, profile(height), None).sigma


@pytest.mark.parametrize("kind", ["radius", "straightness", "angle", "step", "gap"])
def test_several_far_off_side_by_side_draw_nothing_to_them(kind: str) -> None:
    """Each has others beside it, so that none stands alone: a sphere of 49 mm was read as 477 mm."""
    height, exact = shape(kind)
    points = profile(height, noise=noises(1, 1.0, seed=6)[0])
    ends = np.flatnonzero(points.weight(*REGION[kind][0]) > 0.0)
    points.position[ends[-4:], 1] += np.array([0.45, 0.44, 0.6, 0.61])
    points.position[ends[:3], 1] += np.array([0.1, 0.12, 0.09])
    reading = read(gauge(kind), 0, points, None)
    assert abs(reading.value - exact) < 4.0 * reading.sigma
    true = ~np.isin(np.arange(len(height)), np.append(ends[-4:], ends[:3]))
    assert reading.sigma < 1.5 * read(gauge(kind), 0, points.taken(true), None).sigma


def test_residuals_beyond_the_noise_widen_sigma() -> None:
    height, _ = shape("step")
    wavy = height + 1e-4 * np.sin(ACROSS / 7e-4)
    assert read(gauge("step"), 0, profile(wavy), None).sigma > 4.0 * read(gauge("step"), 0, profile(height), None).sigma


@pytest.mark.parametrize(
    ("kind", "height", "told"),
    [
        ("v_depth", 0.1 * ACROSS, "are parallel"),
        ("width", 0.0 * ACROSS, "are parallel"),
        ("peak", ACROSS**2, "no peak within its region"),
    ],
)
def test_a_shape_without_the_dimension_says_so(kind: str, height: np.ndarray, told: str) -> None:
    one = gauge(kind)
    if kind == "peak":
        one = one.model_copy(update={"regions": ((-0.02, -0.01), (0.006, 0.012))})
    reading = read(one, 0, profile(height), profile(height))
    assert told in reading.reason and np.isnan(reading.value) and reading.verdict is None


def test_a_region_without_points_is_told_by_its_name_and_place() -> None:
    away = gauge("radius").model_copy(update={"regions": ((0.1, 0.2),)})
    reading = read(away, 0, profile(0.0 * ACROSS), None)
    assert reading.reason.startswith("too few points in the region 'arc' (100 to 200 mm)")


def test_a_value_where_the_exact_line_is_not_is_told_to_be_of_stray_points() -> None:
    """Of 28 stray points a step of -412 mm was told without a word."""
    height = np.where(ACROSS > 0.0, 0.01, 0.0)
    there = profile(height)
    nowhere = there.taken(np.abs(there.position[:, 0]) < 1e-6)
    reading = read(gauge("step"), 0, there, nowhere)
    assert np.isfinite(reading.value) and np.isnan(reading.truth) and "stray light or noise" in reading.remark
    assert read(gauge("step"), 0, there, there).remark == read(gauge("step"), 0, there, None).remark == ""


@pytest.mark.parametrize("kind", KINDS)
def test_noise_that_is_wild_everywhere_leaves_a_value_or_a_reason(kind: str) -> None:
    """Each round of leaving points out finds others, to the last round."""
    height, _ = shape(kind)
    for noise in np.random.default_rng(5).standard_cauchy((12, len(ACROSS))):
        reading = read(gauge(kind), 0, profile(height, noise=20.0 * noise), None)
        assert reading.reason or (np.isfinite(reading.value) and reading.sigma > 0.0)


def test_a_gap_between_flat_sides_is_none_and_says_what_to_drag_over() -> None:
    height = np.where(np.abs(ACROSS) < 0.005, -0.504, -0.5)
    for noise in (None, *noises(3, 1.0, seed=3)):
        reading = read(gauge("gap"), 0, profile(height, noise=noise), profile(height))
        assert np.isnan(reading.value) and np.isnan(reading.truth) and "no round edges" in reading.reason


def test_a_cylinder_that_is_cut_aslant_has_the_radius_of_its_exact_line() -> None:
    """An ellipse: a circle that is near most of it would leave out other points each time."""
    height = -0.5 + 1.121 * np.sqrt(0.01**2 - np.minimum(ACROSS**2, 0.0099**2))
    for low, high in ((-0.007, 0.007), (-0.008, 0.006), (-0.009, 0.005)):
        asked = gauge("radius").model_copy(update={"regions": ((low, high),)})
        for noise in noises(5, 1.0, seed=5):
            reading = read(asked, 0, profile(height, sigma=3e-6, noise=noise), profile(height, sigma=3e-6))
            assert abs(reading.error_in_sigmas) < 4.0 and reading.points > 0.9 * (high - low) / PITCH


def test_a_flat_top_with_rounded_edges_says_that_it_is_no_peak() -> None:
    beside = np.abs(ACROSS)
    height = -0.5 + np.where(beside < 0.006, 0.01 - 0.0002 * (np.maximum(beside - 0.002, 0.0) / 0.003) ** 2, 0.0)
    asked = gauge("peak").model_copy(update={"regions": ((-0.019, -0.01), (-0.005, 0.005))})
    noise = noises(1, 1.0, seed=9)[0]
    reading = read(asked, 0, profile(height, sigma=1e-6, noise=noise), profile(height, sigma=1e-6))
    assert "of a flat one take a step height" in reading.remark
    true, _ = shape("peak")
    assert read(gauge("peak"), 0, profile(true, noise=noise), profile(true)).remark == ""


@pytest.mark.parametrize(
    ("kind", "height"), [("gap", np.where(np.abs(ACROSS) < 0.005, -0.504, -0.5)), ("width", 0.0 * ACROSS)]
)
def test_what_upright_walls_do_not_give_is_told_to_be_had_from_edge_to_edge(kind: str, height: np.ndarray) -> None:
    assert "take Edge to edge" in read(gauge(kind), 0, profile(height), None).reason


def test_two_points_apart_along_the_profile_are_told_to_be_where_they_were_dragged() -> None:
    """The width of a hole was that of the hand, to a sigma of a micrometre."""
    height, _ = shape("point_to_point")
    along = read(gauge("point_to_point"), 0, profile(height), None)
    assert "along the profile nothing is measured" in along.remark
    steep = read(gauge("point_to_point"), 0, profile(height + 1.1 * ACROSS), None)
    assert steep.remark == ""


def test_far_off_behind_a_soft_edge_draw_nothing_to_them() -> None:
    """The line leaves its curve over a few points before it leaps: the leap is within what is off."""
    for noise in noises(20, 1.0, seed=13):
        height = np.full(len(ACROSS), -0.5)
        first = np.searchsorted(ACROSS, 0.004)
        height[first : first + 4] += 1e-6 * np.array([4.0, 8.0, 12.0, 16.0])
        height[first + 4 :] += 3e-4
        asked = gauge("straightness").model_copy(update={"regions": ((-0.01, 0.0101),)})
        reading = read(asked, 0, profile(height, sigma=1e-6, noise=noise), None)
        assert abs(reading.value) < 6e-6


@pytest.mark.parametrize("kind", ["radius", "width", "v_depth"])
def test_what_hangs_on_a_bend_or_a_crossing_that_noise_made_has_no_value(kind: str) -> None:
    """A flat side had a radius of 890 m on a report's first page, and parallel lines a width of 427 m."""
    height = -0.5 + 0.1 * ACROSS
    for noise in noises(40, 1.0, seed=17):
        reading = read(gauge(kind), 0, profile(height, noise=noise), profile(height))
        assert np.isnan(reading.value) and np.isnan(reading.truth), kind
        assert "points can tell" in reading.reason


def test_a_profile_is_fitted_once_for_all_who_read_and_draw_it() -> None:
    points = profile(shape("step")[0])
    read(gauge("step"), 0, points, points)
    (kept,) = points.fitted.values()
    outline(gauge("step"), points)
    assert list(points.fitted.values()) == [kept]
    for k in range(3 * MOST_GAUGES):  # as of an edge that is dragged
        read(
            gauge("step").model_copy(update={"regions": ((-0.015, -0.003 - 1e-5 * k), (0.003, 0.015))}), 0, points, None
        )
    assert len(points.fitted) <= MOST_GAUGES


def test_a_bend_that_the_points_do_tell_has_its_radius() -> None:
    """An arc that rises by 0.15 mm over its length, under noise of 10 um."""
    radius = 0.12
    height = -0.5 - radius + np.sqrt(radius**2 - ACROSS**2)
    for noise in noises(10, 1.0, seed=19):
        reading = read(gauge("radius"), 0, profile(height, noise=noise), profile(height))
        assert reading.truth == pytest.approx(radius, rel=1e-7) and abs(reading.error_in_sigmas) < 4.0
