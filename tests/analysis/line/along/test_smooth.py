"""Positions estimated along the line: by how much sigma falls, what it covers, and what is not smoothed away."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from analysis.line.along.curve import Kind, Shock, Stretch, averaged_alike, curve_through
from analysis.line.along.five_diagonals import of_second_differences
from analysis.line.along.smooth import smooth_along, smoothed
from analysis.line.extract import extract
from analysis.line.result import Flag, Line
from analysis.line.settings import ExtractionSettings
from tests.analysis.line.line_images import electrons, expected, exposed

ROWS, SIGMA = 2048, 0.05
Y = np.arange(ROWS)
SURFACES = {
    "bead": 60.0 + 4.0 * np.sin(Y / 200.0),
    "thread": 60.0 + 4.0 * np.sin(Y / 30.0),
    "flat": 50.0 + 0.031 * Y,
    "folds": 60.0 + 0.4 * np.abs(Y % 200 - 100.3),
    "steps": 60.0 + 5.0 * (Y // 150 % 2) + 0.02 * Y,
}
LENGTHS = {"white": 1.0, "blurred": 2.0 * math.sqrt(math.pi) * 1.5}
"""Scan lines that err alike: of a blur by s, 2 sqrt(pi) s."""


def noise(kind: str, rng: np.random.Generator) -> np.ndarray:
    """(n,) of variance 1."""
    white = rng.normal(size=ROWS + 200)
    if kind == "white":
        return white[:ROWS]
    return gaussian_filter1d(white, 1.5)[100 : 100 + ROWS] * math.sqrt(LENGTHS[kind])


def measured(surface: str, kind: str, seed: int):
    """What is smoothed of one line of two sigmas, and its errors before and after."""
    sigma = SIGMA * np.where(Y % 700 < 350, 1.0, 0.6)
    before = sigma * noise(kind, np.random.default_rng(seed))
    full = np.full(ROWS, LENGTHS[kind])
    found = smoothed(SURFACES[surface] + before, sigma, full, np.zeros(ROWS))
    return found, before, found.u - SURFACES[surface]


@pytest.mark.parametrize("kind", LENGTHS)
@pytest.mark.parametrize("surface", SURFACES)
def test_errors_fall_as_sigma_tells_and_two_sigmas_hold_them(surface: str, kind: str) -> None:
    lines = [measured(surface, kind, seed) for seed in range(10)]
    ratio = np.concatenate([after / found.sigma for found, _, after in lines])
    squares, told = (np.mean([np.mean(one) for one in many]) for many in (
        [after**2 for _, _, after in lines], [found.sigma**2 for found, _, _ in lines]
    ))  # fmt: skip
    raw = np.mean([np.mean(before**2) for _, before, _ in lines])
    covered = np.mean(np.abs(ratio) < 2.0)
    print(f"\n{math.sqrt(squares / raw):.3f} told {math.sqrt(told / raw):.3f} covered {covered:.3f}")
    assert 0.92 < covered < 0.97
    assert math.sqrt(told / squares) == pytest.approx(1.0, abs=0.12)
    assert squares < 0.6 * raw


@pytest.mark.parametrize("kind", LENGTHS)
def test_the_error_left_is_that_of_the_spline_s_equivalent_kernel(kind: str) -> None:
    """Of a smooth line the variance falls to 3 sqrt(2) / 16 length / h (Silverman, 1984, eq. 3.2)."""
    squares, predicted = [], []
    for seed in range(24):
        found, before, after = measured("bead", kind, 100 + seed)
        inner = slice(100, -100)
        predicted.append(np.nanmean((3.0 * math.sqrt(2.0) / 16.0 * LENGTHS[kind] / found.reach * before.var())[inner]))
        squares.append(np.mean(after[inner] ** 2))
    # some 24 * 1848 / (4 h) independent values: four standard errors, and a tenth for what bends
    independent = 24 * 1848 / (4.0 * np.median(found.reach) * LENGTHS[kind])
    assert np.mean(squares) / np.mean(predicted) == pytest.approx(1.0, abs=0.1 + 4.0 * math.sqrt(2.0 / independent))


def geometric(length: float, rng: np.random.Generator) -> np.ndarray:
    """(n,) of variance 1, correlations falling geometrically, so that `length` neighbours err alike."""
    ratio = (length - 1.0) / (length + 1.0)
    white = rng.normal(size=ROWS + 200) * math.sqrt(1.0 - ratio**2)
    return lfilter([1.0], [1.0, -ratio], white)[200:]


@pytest.mark.parametrize("longest", [1.0, 2.5])
@pytest.mark.parametrize("length", [1.0, 3.0, 9.0])
def test_a_short_smoothing_averages_neighbours_that_err_alike_by_less(longest: float, length: float) -> None:
    ratios, told = [], []
    for seed in range(12):
        before = SIGMA * geometric(length, np.random.default_rng(300 + seed))
        full = np.full(ROWS, length)
        found = smoothed(SURFACES["flat"] + before, np.full(ROWS, SIGMA), full, np.zeros(ROWS), longest)
        assert np.nanmax(found.reach) <= longest * 1.001
        ratios.append(np.mean(((found.u - SURFACES["flat"]) / found.sigma) ** 2))
        told.append(np.mean(found.sigma**2 * found.length) / (SIGMA**2 * length))
    # some 12 * 2048 / max(length, 9) independent errors: four standard errors of their variance, and a tenth for the
    # closed form, which takes scan lines as close
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.1 + 4.0 * math.sqrt(2.0 * max(length, 9.0) / (12 * ROWS)))
    assert np.mean(told) == pytest.approx(1.0, abs=0.05)


def test_what_errs_alike_is_averaged_as_the_spectrum_says() -> None:
    """The integral in closed form against its sum."""
    w = (np.arange(400_000) + 0.5) * 1e-3
    for b in (0.1, 0.7, 3.0, 20.0):
        alone = np.array([b / math.sqrt(2.0 * 8.0)])
        whole = np.sum(1.0 / ((1.0 + w**4) ** 2 * (1.0 + (b * w) ** 2))) / np.sum(1.0 / (1.0 + w**4) ** 2)
        assert averaged_alike(np.array([3.0]), alone) == pytest.approx(whole, rel=1e-4)


@pytest.mark.parametrize("kind", LENGTHS)
def test_means_over_many_scan_lines_are_known_as_well_as_before(kind: str) -> None:
    means, told = [], []
    for seed in range(24):
        found, _, after = measured("flat", kind, 200 + seed)
        for block in np.split(np.arange(64, 1984), 8):
            means.append(after[block].mean())
            told.append(np.mean(found.sigma[block] ** 2 * found.length[block]) / len(block))
    # 192 means: four standard errors of their variance
    assert np.var(means) / np.mean(told) == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 / 192))


def test_steps_are_kept_where_they_are() -> None:
    found, _, after = measured("steps", "white", 5)
    edges = np.flatnonzero(np.diff(Y // 150)) + 1
    assert found.shocks[Kind.STEP] == len(edges)
    beside = np.concatenate([edges - 1, edges])
    assert np.all(np.abs(after[beside]) < 4.0 * found.sigma[beside])
    assert np.all(found.sigma[beside] <= SIGMA)
    assert np.median(found.sigma) < 0.3 * SIGMA


def test_corners_are_kept_and_sigma_knows_them() -> None:
    found, _, after = measured("folds", "white", 6)
    corners = np.flatnonzero((Y % 100 == 0) & (Y > 0) & (Y < 2040))
    assert found.shocks[Kind.CORNER] + found.shocks[Kind.STEP] == len(corners)
    near = (corners[:, None] + np.arange(-3, 4)).ravel()
    assert np.all(np.abs(after[near]) < 4.5 * found.sigma[near])


def test_strays_are_left_as_they_were_and_pull_nothing() -> None:
    sigma, rows = np.full(ROWS, SIGMA), np.array([300, 700, 1500])
    u = SURFACES["bead"] + SIGMA * noise("white", np.random.default_rng(7))
    without = smoothed(u, sigma, np.ones(ROWS), np.zeros(ROWS))
    u[rows] += (3.0, -1.0, 40.0)
    found = smoothed(u, sigma, np.ones(ROWS), np.zeros(ROWS))
    assert found.shocks[Kind.STRAY] == 3
    np.testing.assert_array_equal(found.u[rows], u[rows])
    np.testing.assert_array_equal(found.sigma[rows], SIGMA)
    rest = np.setdiff1d(Y, rows)
    assert np.all(np.abs(found.u - without.u)[rest] < 2.0 * found.sigma[rest])


def test_a_line_without_noise_stays_as_it_is() -> None:
    for surface in ("thread", "steps"):
        u = SURFACES[surface][:600]
        found = smoothed(u, np.full(600, 1e-4), np.ones(600), np.zeros(600))
        np.testing.assert_allclose(found.u, u, atol=4e-4, err_msg=surface)


def test_gaps_are_bridged_and_ends_and_short_pieces_left_alone() -> None:
    u = SURFACES["bead"] + SIGMA * noise("white", np.random.default_rng(8))
    u[400:405], u[800:900], u[910:1000] = np.nan, np.nan, np.nan
    found = smoothed(u, np.full(ROWS, SIGMA), np.ones(ROWS), np.zeros(ROWS))
    assert np.isnan(found.u[400:405]).all()
    assert np.isnan(found.reach[900:910]).all()
    np.testing.assert_array_equal(found.u[900:910], u[900:910])
    assert np.all(found.sigma[390:400] < 0.6 * SIGMA)


def test_any_numbers_are_borne() -> None:
    rng = np.random.default_rng(15)
    for _ in range(60):
        n = int(rng.integers(1, 200))
        u = rng.normal(size=n) * 10.0 ** rng.uniform(-3, 4) + np.cumsum(rng.normal(size=n)) * 10.0 ** rng.uniform(-3, 3)
        sigma = 10.0 ** rng.uniform(-9, 3, n) if rng.random() < 0.5 else np.full(n, 10.0 ** rng.uniform(-9, 3))
        u[rng.random(n) < rng.random()] = np.nan
        sigma[rng.random(n) < 0.1] = rng.choice([np.nan, np.inf, 0.0])
        found = smoothed(u, sigma, 10.0 ** rng.uniform(0.0, 3.0, n), np.zeros(n))
        known = np.isfinite(found.reach)
        assert np.isfinite(found.u[known]).all() and (found.sigma[known] > 0.0).all()
        np.testing.assert_array_equal(np.isnan(found.u), np.isnan(u))


def test_diagonals_are_those_of_the_whole_matrices() -> None:
    rng = np.random.default_rng(9)
    n = 30
    there = rng.random(n) > 0.1
    stretch = Stretch(rng.normal(size=n), rng.uniform(0.5, 2.0, n), rng.uniform(1.0, 3.0, n), there)
    curve = curve_through(stretch, [Shock(Kind.CORNER, 10), Shock(Kind.STEP, 20), Shock(Kind.STRAY, 5)])
    seconds = np.diff(np.eye(n), 2, axis=0)
    weights = np.where(curve.bent[2:], 1.0 / curve.q[2:], 0.0)
    inverse = np.linalg.inv(np.diag(curve.weight) + seconds.T @ (weights[:, None] * seconds))
    np.testing.assert_allclose(curve.u, inverse @ (curve.weight * stretch.u), rtol=1e-8)
    for d, values in enumerate(curve.covariance):
        np.testing.assert_allclose(values[: n - d], np.diag(inverse, d), rtol=1e-8, atol=1e-12)
    bends = seconds @ inverse @ seconds.T
    for later in range(2):
        mine = of_second_differences(curve.covariance, later)[2 : n - later]
        np.testing.assert_allclose(mine, np.diag(bends, later), rtol=1e-7, atol=1e-12)


def test_sigmas_that_jump_tell_nothing_of_noise_that_is_alike() -> None:
    """As of photographs, whose neighbours err alike while their sigmas differ."""
    rng = np.random.default_rng(13)
    covered = []
    for _ in range(16):
        told = SIGMA * rng.choice([1.0, 2.0], ROWS)
        u = SURFACES["flat"] + 0.08 * noise("blurred", rng)
        found = smoothed(u, told, np.full(ROWS, LENGTHS["blurred"]), np.zeros(ROWS))
        covered.append(np.mean(np.abs(found.u - SURFACES["flat"]) < 2.0 * found.sigma))
    assert 0.88 < np.mean(covered) < 0.99


def line_of(u: np.ndarray, flag: np.ndarray | None = None, **other) -> Line:
    column = np.full((ROWS, 1), SIGMA)
    flags = np.zeros((ROWS, 1), np.uint8) if flag is None else flag[:, None].astype(np.uint8)
    width = np.full((ROWS, 1), 2.0)
    return Line("rows", "likelihood", u[:, None], column, width, column, column, column, flags, **other)


def test_what_errs_by_its_shape_is_not_averaged() -> None:
    u = SURFACES["bead"] + SIGMA * noise("white", np.random.default_rng(10))
    flag = np.where((Y > 500) & (Y < 600), Flag.MISFIT, np.where(Y > 1900, Flag.BLENDED, Flag.OK))
    found = smooth_along(line_of(u, flag))
    same = (found.u == u[:, None])[:, 0]
    np.testing.assert_array_equal(same, flag != Flag.OK)
    np.testing.assert_array_equal((found.sigma_u == SIGMA)[:, 0], same)


def test_positions_that_know_less_than_the_line_is_wide_are_left_alone() -> None:
    u = SURFACES["bead"] + SIGMA * noise("white", np.random.default_rng(14))
    line, unsure = line_of(u), (Y > 700) & (Y < 900)
    u[unsure] += 30.0
    found = smooth_along(replace(line, sigma_u=np.where(unsure, 9.0, SIGMA)[:, None]))
    np.testing.assert_array_equal(found.u[unsure, 0], u[unsure])
    assert np.all(np.abs(found.u[~unsure, 0] - SURFACES["bead"][~unsure]) < 5.0 * found.sigma_u[~unsure, 0])


def test_an_error_in_common_is_not_averaged_away() -> None:
    u = SURFACES["flat"] + 0.03 * noise("white", np.random.default_rng(11))
    found = smooth_along(line_of(u, shared_u=np.full((ROWS, 1), 0.04)))
    assert found.shared_u is not None
    np.testing.assert_allclose(found.shared_u, 0.04, rtol=1e-6)
    assert np.all(found.sigma_u > 0.04) and np.median(found.sigma_u) == pytest.approx(0.0402, abs=2e-4)


def test_lengths_that_are_not_known_are_one() -> None:
    u = SURFACES["bead"] + SIGMA * noise("white", np.random.default_rng(16))
    unknown = Y[:, None] % 7 == 0
    found = smooth_along(line_of(u, length_apart=np.where(unknown, np.nan, 1.0)))
    assert np.median(found.sigma_u) < 0.3 * SIGMA


def test_a_line_without_sigmas_is_left_and_it_is_told() -> None:
    line = line_of(SURFACES["bead"])
    found = smooth_along(replace(line, sigma_u=np.full_like(line.u, np.nan)))
    np.testing.assert_array_equal(found.u, line.u)
    assert "not smoothed" in found.note


def test_an_image_of_a_weld_is_measured_to_a_third_of_the_sigma() -> None:
    centre = 60.0 + np.where(Y[:600] < 300, 0.02 * Y[:600], 12.0 + 3.0 * np.cos(Y[:600] / 60.0))
    image = exposed(expected(120, centre, 600.0, 2.0, 20.0), 5.0, np.random.default_rng(12))
    alone = extract(image, noise=electrons(5))
    found = extract(image, noise=electrons(5), smooth_along=True)
    assert "smoothed along the line over" in found.note and "1 step kept" in found.note
    before, after = ((one.u[:, 0] - centre) for one in (alone, found))
    assert np.sqrt(np.mean(after**2)) < 0.5 * np.sqrt(np.mean(before**2))
    assert 0.9 < np.mean(np.abs(after) < 2.0 * found.sigma_u[:, 0]) < 0.99
    np.testing.assert_array_equal(found.width, alone.width)


def test_along_time_and_along_the_line_are_not_both_done() -> None:
    with pytest.raises(ValidationError, match="spacetime and smooth_along"):
        ExtractionSettings(spacetime=True, smooth_along=True)
