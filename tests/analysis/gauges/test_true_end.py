"""The truth of an edge is the end of the part's own surface, whatever scan lines meet it; else it is told why not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.profile import Profile
from analysis.gauges.read import Reading, read
from analysis.gauges.true_end import TrueSection
from tests.analysis.gauges.profiles import ACROSS, PITCH, gauge, profile, slot

SLOT = gauge("edge_to_edge")
FIRST, SECOND, DEPTH = -0.00503, 0.00508, 0.01
WIDTH = SECOND - FIRST
END = 0.02


def section(*places: tuple[float, float]) -> TrueSection:
    """From place to place, m."""
    corners = np.array(places)
    pieces = np.stack([corners[:-1], corners[1:]], axis=1)
    return TrueSection(pieces, np.zeros((len(pieces), 2), dtype=np.bool_))


def level(*rim: tuple[float, float], first: float = FIRST) -> TrueSection:
    """A slot in a level face; rim: places from the face's end at its second edge outwards, beyond its own wall."""
    foot = (first, -0.5 - DEPTH), (SECOND, -0.5 - DEPTH)
    return section((-END, -0.5), (first, -0.5), *foot, *(rim or ((SECOND, -0.5),)), (END, -0.5))


def seen(first: float = FIRST, second: float = SECOND) -> Profile:
    return profile(-0.5 - DEPTH * (np.abs(ACROSS - 0.5 * (first + second)) < 0.5 * (second - first)))


def read_with(part: TrueSection, points: Profile | None = None) -> Reading:
    points = points or seen()
    return read(SLOT, 0, points, replace(points, true_section=part, fitted={}))


def test_slots_at_any_phase_have_their_own_width_as_truth_and_an_error_like_sigma() -> None:
    """The truth was of the same scan lines: the error was 0 where it was half a pitch."""
    trials, random = 400, np.random.default_rng(41)
    error = np.zeros(trials)
    for k in range(trials):
        first, second = random.uniform(-0.006, -0.004), random.uniform(0.004, 0.006)
        tops = [(x, -0.5 + 0.1 * x) for x in (-END, first, second, END)]
        feet = [(x, -0.5 + 0.1 * x - DEPTH) for x in (first, second)]
        one = read_with(section(*tops[:2], *feet, *tops[2:]), profile(slot(first, second)))
        assert one.truth == pytest.approx((second - first) * np.sqrt(1.01), abs=1e-12)
        error[k] = one.error_in_sigmas
    assert abs(error.mean()) < 3.3 / np.sqrt(trials)
    assert error.std() == pytest.approx(1.0, abs=3.3 * np.sqrt((2.4 - 1.0) / 4.0 / trials))
    assert np.mean(np.abs(error) <= 2.0) > 0.93


def test_a_plate_ends_where_its_mesh_does_even_where_the_last_scan_lines_meet_its_wall() -> None:
    plate = section((FIRST, -0.51), (FIRST, -0.5), (SECOND, -0.5), (SECOND, -0.51))
    points = profile(-0.5 - DEPTH * (np.abs(ACROSS - 0.5 * (FIRST + SECOND)) > 0.5 * WIDTH))
    assert read_with(plate, points).truth == pytest.approx(WIDTH, abs=1e-12)
    assert read_with(TrueSection(plate.pieces[1:2], plate.clipped[1:2]), points).truth == pytest.approx(WIDTH)
    wall = np.flatnonzero(ACROSS > SECOND)[:3]
    points.position[wall] = np.stack([np.full(3, SECOND), -0.5 - np.array([0.3, 1.3, 2.3]) * PITCH], axis=1)
    assert read_with(plate, points).truth == pytest.approx(WIDTH, abs=1e-9)


def test_scan_lines_that_run_to_the_left_have_the_same_truth() -> None:
    points = seen()
    turned = replace(points.taken(np.arange(len(ACROSS))[::-1]), index=np.arange(len(ACROSS)), fitted={})
    assert read_with(level(), turned).truth == pytest.approx(WIDTH, abs=1e-12)


def test_a_wall_in_many_pieces_and_one_that_leans_begin_at_their_corner() -> None:
    steps = [(SECOND, -0.5 - depth * PITCH) for depth in (3.0, 0.6, 0.2, 0.0)]
    assert read_with(level(*steps)).truth == pytest.approx(WIDTH, abs=1e-12)
    leaning = [(SECOND - depth * PITCH, -0.5 - depth * PITCH) for depth in (5.0, 0.5, 0.0)]
    assert read_with(level(*leaning)).truth == pytest.approx(WIDTH, abs=1e-12)


def rounded(radius: float) -> list[tuple[float, float]]:
    """From the wall at SECOND up onto the face, in facets of five degrees."""
    turn = np.radians(np.linspace(0.0, 90.0, 19))
    across, up = SECOND + radius * (1.0 - np.cos(turn)), -0.5 - radius * (1.0 - np.sin(turn))
    return list(zip(across.tolist(), up.tolist(), strict=True))


def test_a_rim_that_is_rounded_by_less_than_scan_lines_tell_is_at_its_wall() -> None:
    """Of facets as steep as a wall the last 2 % of the radius are left out."""
    radius = 0.5 * PITCH
    points = seen()
    near = np.abs(ACROSS - SECOND - 0.5 * radius) < 0.5 * radius
    across, up = np.array(rounded(radius)).T
    points.position[near, 1] = np.interp(ACROSS[near], across, up)
    assert read_with(level(*rounded(radius)), points).truth == pytest.approx(WIDTH, abs=0.03 * radius)


@pytest.mark.parametrize(
    ("part", "told"),
    [
        (TrueSection(), "where the surface ends in the region 'first edge' is not known; no truth: "),
        (level(first=FIRST + 0.003), "the surface goes on where its points end in the region 'first edge', hidden"),
        (level(*rounded(8.0 * PITCH)), "the surface bends away in the region 'second edge'"),
    ],
)
def test_an_end_that_is_not_known_is_no_truth_and_the_remark_says_why(part: TrueSection, told: str) -> None:
    points = seen()
    if "bends" in told:
        round_top = np.array(rounded(8.0 * PITCH))
        near = (ACROSS > SECOND) & (ACROSS < SECOND + 8.0 * PITCH)
        points.position[near, 1] = np.interp(ACROSS[near], *round_top.T)
    found = read_with(part, points)
    assert np.isfinite(found.value) and np.isnan(found.truth) and np.isnan(found.error)
    assert told in found.remark and found.remark.startswith("no truth: ")


def test_the_end_of_the_fan_is_none_of_the_part() -> None:
    face = section((FIRST, -0.5), (SECOND, -0.5))
    points = seen().taken(np.abs(ACROSS - 0.5 * (FIRST + SECOND)) < 0.5 * WIDTH)
    points.position[:, 1] = -0.5
    assert read_with(face, points).truth == pytest.approx(WIDTH, abs=1e-12)
    cut = replace(face, clipped=np.array([[False, True]]))
    assert "the laser's fan ends in the region 'second edge'" in read_with(cut, points).remark
