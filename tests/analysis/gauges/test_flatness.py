"""The flatness of a scanned surface: exact without noise, its sigma true with noise, and told where it cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.flatness import CELLS, Cells, Form, cells, flatness
from analysis.gauges.of_scan import Patch, patch, read_scan
from analysis.gauges.one_surface import together
from analysis.gauges.read import Reading
from analysis.report.gauge_table import verdict_text
from tests.analysis.gauges.profiles import ACROSS, gauge, noises, profile

REGION = (-0.01, 0.01)
PITCH = 1e-3
SIGMA = 1e-5


def places(steps: int) -> np.ndarray:
    return (np.arange(steps) - 0.5 * (steps - 1)) * PITCH


def pose(along: float) -> np.ndarray:
    """Of the laser on the part, shifted across its own plane."""
    found = np.eye(4)
    found[0, 3] = along
    return found


def saddle(along: float, rise: float) -> np.ndarray:
    """Heights of a tilted surface that rises along the fan as much as it falls along the way."""
    return -0.5 + 0.05 * ACROSS + 0.02 * along + rise * ((ACROSS / 0.01) ** 2 - (along / 0.01) ** 2)


def scan(rise: float, noise: np.ndarray | None, steps: int = 21, length: float = 1.0) -> list[Cells]:
    return [
        cells(profile(saddle(y, rise), SIGMA, length, None if noise is None else noise[k]), REGION, pose(y))
        for k, y in enumerate(places(steps))
    ]


def form(profiles: list[Cells], like: Form | None = None) -> Form:
    found = flatness(profiles, like)
    assert isinstance(found, Form), found
    return found


def test_a_saddle_has_the_flatness_of_its_corners_and_edges() -> None:
    found = form(scan(5e-5, None))
    x = max(np.abs(one.position[:, 1]).max() for one in scan(5e-5, None)) / 0.01
    # off the least-squares plane the saddle keeps its form; its tilt takes the cosine of the slope off
    assert found.value == pytest.approx(5e-5 * (x**2 + 1.0) / np.hypot(1.0, np.hypot(0.05, 0.02)), rel=2e-3)
    assert found.points > 90 * 21


@pytest.mark.parametrize("trials", [40, pytest.param(150, marks=pytest.mark.validation)])
@pytest.mark.parametrize("length", [1.0, 7.0])
def test_its_sigma_is_that_of_its_errors(length: float, trials: int) -> None:
    steps = 21
    truth = form(scan(5e-5, None)).value
    found = [form(scan(5e-5, noises(steps, length, 100 + k), steps, length)) for k in range(trials)]
    off = np.array([(one.value - truth) / one.sigma_random for one in found])
    # peak and valley are chosen by the noise among neighbours, hence a little bias is allowed
    assert abs(off.mean()) < 0.3 + 3.0 / np.sqrt(trials)
    assert abs(off.std() - 1.0) < 3.0 / np.sqrt(2.0 * trials)


def test_a_flat_surface_is_told_as_flat_within_three_of_its_sigmas() -> None:
    found = [form(scan(0.0, noises(21, 1.0, 300 + k))) for k in range(100)]
    off = np.array([one.value / one.sigma_random for one in found])
    assert 0.5 < off.mean() < 2.5
    assert np.mean(off < 3.5) > 0.9


def test_a_false_cell_is_left_out() -> None:
    clean = scan(5e-5, noises(21, 1.0, 5))
    before = form(clean).value
    height = saddle(0.0, 5e-5)
    height[100:112] += 2e-3
    clean[10] = cells(profile(height, SIGMA, 1.0, noises(1, 1.0, 6)[0]), REGION, pose(0.0))
    assert form(clean).value == pytest.approx(before, abs=2e-6)


def test_what_all_points_share_moves_the_form_only_where_it_bends_it() -> None:
    lifted = np.zeros((len(ACROSS), 2, 1))
    lifted[:, 1, 0] = 1e-4
    bent = lifted * (ACROSS / 0.01)[:, None, None] ** 2
    sigma = []
    for shared in (lifted, bent):
        parts = [cells(profile(saddle(y, 5e-5), SIGMA, systematic=shared), REGION, pose(y)) for y in places(21)]
        sigma.append(form(parts).sigma_systematic)
    assert sigma[0] < 1e-9
    assert sigma[1] == pytest.approx(1e-4, rel=0.2)


def test_two_profiles_have_no_flatness_and_say_what_it_needs() -> None:
    for steps in (1, 2):
        told = flatness(scan(5e-5, None, steps=steps))
        assert isinstance(told, str) and "needs 3 steps" in told
    assert "too few points" in str(flatness([]))


def test_readings_of_a_scan_come_once_with_their_truth() -> None:
    one = gauge("flatness")
    noise = noises(21, 1.0, 9)
    both = [
        (profile(saddle(y, 5e-5), SIGMA, 1.0, noise[k]), profile(saddle(y, 5e-5))) for k, y in enumerate(places(21))
    ]
    kept = [patch(one, *two, pose(y), pose(y)) for two, y in zip(both, places(21), strict=True)]
    (found,) = read_scan(kept)
    assert found.step is None and found.points > 90 * 21
    assert abs(found.error_in_sigmas) < 4.0
    assert found.truth == pytest.approx(form(scan(5e-5, None)).value, rel=1e-3)
    assert all(len(each.measured.position) <= CELLS for each in kept)


def beyond_the_part(kind: str, noise: np.ndarray | None, seed: int) -> list[Cells]:
    """Five steps of the table, 52 mm below the surface, or of a step of stray points alone, or none."""
    random, far = np.random.default_rng(seed), places(21)[-1]
    if kind == "stray":
        height = saddle(0.0, 0.0) + random.uniform(-4.6, 0.3, len(ACROSS))
        return [cells(profile(height, 5e-5), REGION, pose(far + PITCH))]
    steps = range(5) if kind == "table" else ()
    return [
        cells(profile(saddle(0.0, 0.0) - 0.052, SIGMA, 1.0, None if noise is None else noise[k]), REGION, pose(far + y))
        for k, y in enumerate(PITCH * (1.0 + k) for k in steps)
    ]


def read_of(measured: list[Cells], truth: list[Cells]) -> Reading:
    one = gauge("flatness", nominal=0.0, upper=1e-3)
    (found,) = read_scan([Patch(one, *both) for both in zip(measured, truth, strict=True)])
    return found


@pytest.mark.parametrize(
    ("kind", "told"),
    [("none", ""), ("stray", "points in its region of all steps are left out, up to"), ("table", "holds another one")],
)
def test_what_lies_beyond_the_part_is_no_part_of_its_flatness(kind: str, told: str) -> None:
    """A scan that went on over the table had a flatness of 1763 mm, of a part 52 mm high, and its truth was 1797 mm."""
    noise, unseen = noises(26, 1.0, 41), cells(profile(ACROSS), (1.0, 2.0), pose(0.0))
    clean, exact = scan(5e-5, noise), scan(5e-5, None)
    before = form(clean)
    beyond = beyond_the_part(kind, noise, 7)
    seen = beyond_the_part(kind, None, 7) if kind == "table" else [unseen] * len(beyond)
    found = read_of(clean + beyond, exact + seen)
    assert found.value == pytest.approx(before.value, rel=1e-9) and found.sigma == pytest.approx(before.sigma_random)
    assert found.truth == pytest.approx(form(exact, before).value, rel=1e-9) and found.points == before.points
    assert told in found.remark and bool(told) == bool(found.remark)
    assert ("misfit" in verdict_text(found.verdict, remark=found.remark)) == (kind == "table")


def test_a_region_of_two_surfaces_alike_has_no_flatness_and_says_why() -> None:
    half = scan(5e-5, noises(21, 1.0, 3))
    lowered = [replace(one, position=one.position - [0.0, 0.0, 0.01]) for one in half[::2]]
    told = flatness(lowered + half[1::2])
    assert isinstance(told, str) and "more than one surface: 52 % of its cells" in told


@pytest.mark.parametrize("radius", [0.012, 0.05, 1.0])
def test_a_surface_that_bends_on_is_one_and_is_no_stray_at_its_ends(radius: float) -> None:
    """Of a round bar the form of second degree leaves much over, but no leap: all of its cells are of it."""
    height = -0.5 + np.sqrt(radius**2 - np.minimum(ACROSS**2, (0.99 * radius) ** 2))
    noise = noises(21, 1.0, 8)
    bar = [cells(profile(height, SIGMA, 1.0, noise[k]), REGION, pose(y)) for k, y in enumerate(places(21))]
    assert form(bar).farthest == 0.0


def test_the_misses_of_a_surface_end_at_a_leap() -> None:
    grown = 1.4 ** np.arange(20.0)
    assert together(grown).all() and together(0.1 * grown).all()
    assert np.array_equal(together(np.append(grown, -4e3)), np.append(np.ones(20, dtype=bool), False))
