"""From edge to edge across upright walls, as unsure as the scan lines leave it; where no edge is, the reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.outline import outline
from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading, read
from tests.analysis.gauges.profiles import ACROSS, PITCH, between, gauge, noises, profile, slot

SLOT = gauge("edge_to_edge")
EXACT = 0.01 * np.sqrt(1.01)
FLAT = 0.0 * ACROSS - 0.5


def read_slot(points: Profile, *regions: tuple[float, float]) -> Reading:
    return read(SLOT.model_copy(update={"regions": regions}) if regions else SLOT, 0, points, points)


@pytest.mark.parametrize("seen", ["the floor", "nothing"])
def test_sigma_is_that_of_edges_anywhere_between_two_scan_lines(seen: str) -> None:
    """Slots of 400 widths and places: the spread of a sum of two uniform errors, whose kurtosis is 2.4."""
    trials, random = 400, np.random.default_rng(21)
    error, sigma = np.zeros((2, trials))
    for k, noise in enumerate(noises(trials, 1.0, seed=22)):
        first, second = random.uniform(-0.006, -0.004), random.uniform(0.004, 0.006)
        points = profile(slot(first, second), noise=noise)
        points = points if seen == "the floor" else points.taken(~between(first, second))
        one = read(SLOT, 0, points, None)
        error[k], sigma[k] = one.value - (second - first) * np.sqrt(1.01), one.sigma
    assert sigma == pytest.approx(PITCH * np.sqrt(1.01) / np.sqrt(6.0), rel=0.02)
    assert abs(error.mean()) < 3.3 * sigma.mean() / np.sqrt(trials)
    assert error.std() / sigma.mean() == pytest.approx(1.0, abs=3.3 * np.sqrt((2.4 - 1.0) / 4.0 / trials))
    # of such a sum 96.6 % lie within two sigma
    assert np.mean(np.abs(error) <= 2.0 * sigma) > 0.93
    assert np.abs(error).max() < PITCH * np.sqrt(1.01) + 1e-5


def test_what_points_err_along_the_profile_is_in_sigma_too() -> None:
    points = profile(slot(-0.005, 0.005))
    slanted = replace(points, random=np.tile([3e-5, 1e-5], (len(ACROSS), 1)))
    alone, both = (read_slot(one).sigma_random for one in (points, slanted))
    assert both**2 - alone**2 == pytest.approx(2.0 * 3e-5**2, rel=0.1)


def test_a_wall_that_is_seen_and_a_rounded_rim_leave_the_edge_at_the_top() -> None:
    height = slot(-0.005, 0.005)
    wall = np.flatnonzero(ACROSS < 0.005)[-4:]
    height[wall] = -0.5 - np.array([0.008, 0.006, 0.004, 0.002])
    assert read_slot(profile(height)).value == pytest.approx(EXACT, rel=1e-7)
    height[wall[-1]] = -0.5 - 1.5 * PITCH
    assert read_slot(profile(height)).value == pytest.approx(EXACT, rel=1e-7)


def test_a_plate_is_as_wide_as_a_slot_in_reverse_even_where_nothing_is_seen_beside_it() -> None:
    height = slot(-0.005, 0.005, depth=-0.01)
    over = profile(height)
    alone = over.taken(np.abs(ACROSS) < 0.005)
    assert read_slot(over).value == pytest.approx(EXACT, rel=1e-7) and read_slot(over).remark == ""
    assert read_slot(alone).value == pytest.approx(EXACT, rel=1e-7)
    assert "the image or the laser's fan" in read_slot(alone).remark


def test_scan_lines_that_run_to_the_left_give_the_same() -> None:
    points = profile(slot(-0.005, 0.0052), noise=noises(1, 1.0, seed=4)[0])
    turned = replace(points.taken(np.arange(len(ACROSS))[::-1]), index=np.arange(len(ACROSS)), fitted={})
    assert read_slot(turned).value == pytest.approx(read_slot(points).value, rel=1e-9)


def test_surfaces_of_unlike_heights_are_apart_along_themselves() -> None:
    height = np.where(ACROSS > 0.0, FLAT + 0.003, FLAT) - 0.02 * (np.abs(ACROSS) < 0.005)
    found = read_slot(profile(height))
    assert found.value == pytest.approx(0.01, rel=1e-7)
    _, drawn = outline(SLOT, profile(height))
    assert drawn == pytest.approx(np.array([[-0.005, -0.5], [0.005, -0.5]]), abs=1e-9)


def test_of_edges_that_are_not_level_it_is_told_and_drawn_along_what_they_are_apart() -> None:
    """A level top and, 8 mm lower, a side that falls by 0.5: along the mean direction of both."""
    height = np.where(ACROSS > 0.0, FLAT - 0.008 - 0.5 * (ACROSS - 0.005), FLAT) - 0.02 * (np.abs(ACROSS) < 0.005)
    points = profile(height)
    found, (curves, drawn) = read_slot(points), outline(SLOT, points)
    half = 0.5 * np.arctan(0.5)
    along, across = np.array([np.cos(half), -np.sin(half)]), np.array([np.sin(half), np.cos(half)])
    assert found.value == pytest.approx(np.array([0.01, -0.008]) @ along, abs=2e-5)
    assert curves[-1][0] == pytest.approx(drawn[1], abs=1e-12)
    assert curves[-1][1] == pytest.approx([0.005, -0.508], abs=5e-5)
    assert np.diff(curves[-1], axis=0)[0] @ np.diff(drawn, axis=0)[0] == pytest.approx(0.0, abs=1e-12)
    lower = -np.array([0.01, -0.008]) @ across
    assert "the mean direction of the two surfaces, which are at 26.57°" in found.remark
    assert "at -13.28° in the profile" in found.remark and "mm below the first" in found.remark
    assert float(found.remark.split(" lies ")[1].split()[0]) == pytest.approx(1e3 * lower, abs=1e-3)


def test_edges_that_are_level_within_their_sigma_are_not_told_to_be_apart() -> None:
    random = np.random.default_rng(41)
    for noise in noises(60, 1.0, seed=42):
        points = profile(slot(random.uniform(-0.006, -0.004), random.uniform(0.004, 0.006)), noise=noise)
        assert read_slot(points).remark == "" and len(outline(SLOT, points)[0]) == 2


def test_false_points_that_stand_alone_are_no_edges() -> None:
    height = slot(-0.005, 0.005)
    height[[60, 61, 70, 130]] += np.array([0.3, 0.3, -0.2, 0.4])
    assert read_slot(profile(height)).value == pytest.approx(EXACT, rel=1e-7)


def beside_stray(seed: int, most: int = 6) -> Profile:
    """A top of slope 0.1 and 10 mm, and beyond either end so many points anywhere along their lines of sight."""
    random, count = np.random.default_rng(seed), len(ACROSS)
    far = np.flatnonzero(np.abs(ACROSS) > 0.0052)
    left, right = far[ACROSS[far] < 0.0], far[ACROSS[far] > 0.0]
    stray = np.concatenate([random.choice(one[np.abs(ACROSS[one]) < 0.009], most, False) for one in (left, right)])
    height = -0.5 + 0.1 * ACROSS
    height[stray] += random.choice([-1.0, 1.0], 2 * most) * random.uniform(0.003, 0.1, 2 * most)
    return profile(height, noise=noises(1, 1.0, seed)[0]).taken(between(-0.005, 0.005) | np.isin(range(count), stray))


@pytest.mark.parametrize("seed", range(40))
def test_stray_points_beyond_a_part_are_not_what_ends_there(seed: int) -> None:
    found = read_slot(beside_stray(seed))
    assert found.value == pytest.approx(EXACT, abs=5e-5), found.reason


def test_many_stray_points_that_are_passed_over_are_told_and_few_are_not() -> None:
    told = [read_slot(beside_stray(seed)).remark for seed in range(40)]
    assert any("6 of the 26 points in the region 'first edge' are stray ones" in one for one in told)
    assert not any("stray" in read_slot(beside_stray(seed, 2)).remark for seed in range(40))


def test_where_stray_points_leave_no_surface_they_are_named_as_the_cause() -> None:
    found = read_slot(beside_stray(3), (-0.009, -0.0047), SLOT.regions[1])
    assert np.isnan(found.value) and "stray points in it, off every surface, are a likely cause" in found.reason


@pytest.mark.parametrize(
    ("height", "regions", "told"),
    [
        (FLAT, SLOT.regions, "no edge in the region 'first edge': its points go on without a jump"),
        (FLAT + np.minimum(np.abs(ACROSS) - 0.005, 0.0), SLOT.regions, "of slanted walls, take a width"),
        (slot(-0.005, 0.005), (SLOT.regions[0], (-0.0049, 0.005)), "widen it over that"),
        (slot(-0.005, 0.005), (SLOT.regions[0], (0.001, 0.0057)), "too few points on the surface that ends"),
    ],
)
def test_a_region_without_an_edge_says_why(
    height: np.ndarray, regions: tuple[tuple[float, float], ...], told: str
) -> None:
    for noise in (None, noises(1, 1.0, seed=8)[0]):
        points = profile(height, noise=noise)
        found = read_slot(points, *regions)
        assert told in found.reason and np.isnan(found.value) and np.isnan(found.truth)
        assert outline(Gauge(kind="edge_to_edge", regions=regions), points)[0] == []


def test_a_false_point_in_an_opening_is_no_surface() -> None:
    points = profile(FLAT - 0.1 * (np.abs(ACROSS) < 0.005))
    points.position[[80, 120], 1] += 0.3
    opening = points.taken((np.abs(ACROSS) > 0.005) | np.isin(np.arange(len(ACROSS)), [80, 120]))
    assert read_slot(opening).value == pytest.approx(0.01, rel=1e-7)


def test_a_region_over_a_whole_hole_says_that_it_has_two_edges() -> None:
    points = profile(FLAT, noise=noises(1, 1.0, seed=9)[0]).taken(np.abs(ACROSS) > 0.005)
    found = read_slot(points, (-0.012, 0.009), (0.001, 0.009))
    assert found.reason.startswith("two edges in the region 'first edge'")
    assert np.isfinite(read_slot(points).value)


def test_points_that_are_missing_on_a_part_that_goes_on_are_told_to_be_no_edges() -> None:
    dark = profile(FLAT).taken(np.abs(ACROSS) > 0.005)
    assert "the points end there, and not the part" in read(SLOT, 0, dark, profile(FLAT)).remark
    nowhere = profile(FLAT).taken(ACROSS > 0.015)
    assert read(SLOT, 0, dark, nowhere).sigma == read(SLOT, 0, dark, profile(FLAT)).sigma > 0.4 * PITCH


def test_noise_alone_makes_no_edges_where_points_are_close() -> None:
    """Points 0.2 mm apart under noise of 0.5 mm: jumps of five distances are among neighbours everywhere."""
    for noise in noises(100, 1.0, seed=12):
        assert "without a jump" in read(SLOT, 0, profile(FLAT, sigma=5e-4, noise=noise), None).reason


def strips(first: float, second: float, floor: float) -> Profile:
    """A slot as pixels see it, each a strip as high as the pitch, in which the stronger of two lines is the point.

    floor: how strong its line is beside the face's; 0: it is not seen.
    """
    part = np.clip((np.abs(ACROSS - 0.5 * (first + second)) - 0.5 * (second - first)) / PITCH + 0.5, 0.0, 1.0)
    below = floor * (1.0 - part)
    height = -0.5 - 0.01 * (below > part)
    strength = 1e3 * np.maximum(part, below)
    return replace(profile(height), strength=strength).taken(strength > 20.0)


@pytest.mark.parametrize("floor", [0.0, 0.1, 0.5, 1.0, 4.0])
def test_strips_that_lie_on_an_edge_in_part_bias_nothing(floor: float) -> None:
    """Holes with nothing behind them came out narrower by a distance of scan lines, twice the sigma told."""
    trials, random = 200, np.random.default_rng(31)
    off = np.zeros(trials)
    for k in range(trials):
        first, second = random.uniform(-0.006, -0.004), random.uniform(0.004, 0.006)
        one = read(SLOT, 0, strips(first, second, floor), None)
        off[k] = (one.value - (second - first)) / one.sigma
    assert abs(off.mean()) < 3.3 / np.sqrt(trials)
    assert off.std() == pytest.approx(1.0, abs=3.3 * np.sqrt((2.4 - 1.0) / 4.0 / trials))


def test_strengths_that_vary_leave_it_unsure_which_strips_are_on_the_surface() -> None:
    even = strips(-0.005, 0.005, 0.5)
    assert even.strength is not None
    uneven = replace(even, strength=even.strength * np.random.default_rng(3).normal(1.0, 0.2, len(even.index)))
    ratio = read(SLOT, 0, uneven, None).sigma_random / read(SLOT, 0, even, None).sigma_random
    # of 20 points at either edge the spread is known to a sixth
    assert ratio == pytest.approx(np.sqrt(1.0 + 12.0 * 0.2**2), rel=0.25)
