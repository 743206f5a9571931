"""Scan lines on which the fit failed: their centre of mass, with the sigma that it turns out to have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.line.result import Flag, Line
from analysis.line.selection.continuity import select_chain
from analysis.line.settings import ExtractionSettings
from studio.photographs.choice import carried_on
from studio.photographs.completion import GAP, completed, offered, without_detours

COUNT, WIDTH, SCATTER = 400, 2.0, 0.3


def lines(seed: int = 1) -> tuple[Line, Line, np.ndarray]:
    """A line by a fit that is nearly exact, the same by centres that scatter by SCATTER, and the truth."""
    rng = np.random.default_rng(seed)
    truth = 50.0 + 0.1 * np.arange(COUNT)

    def line(sigma: float) -> Line:
        values = {name: np.full((COUNT, 1), 1.0) for name in ("amplitude", "background", "chi2", "length_apart")}
        u = (truth + sigma * rng.standard_normal(COUNT))[:, None]
        told, width = np.full((COUNT, 1), 0.01), np.full((COUNT, 1), WIDTH)
        flag = np.zeros((COUNT, 1), np.uint8)
        return Line("rows", "likelihood", u, sigma_u=told, width=width, flag=flag, **values)

    return line(0.01), line(SCATTER), truth


def without(line: Line, rows: np.ndarray, flag: Flag) -> Line:
    u, flags = line.u.copy(), line.flag.copy()
    u[rows], flags[rows] = np.nan, flag
    return replace(line, u=u, flag=flags)


def test_what_a_fit_leaves_out_is_filled_with_a_sigma_that_holds() -> None:
    fits, centres, truth = lines()
    gone = np.arange(5, COUNT - 5, 4)
    found = completed(without(fits, gone, Flag.NOT_CONVERGED), centres)
    assert found.valid.all() and np.all(found.flag[gone] == Flag.MISFIT)
    ratio = (found.u[gone, 0] - truth[gone]) / found.sigma_u[gone, 0]
    assert abs(np.std(ratio) - 1.0) < 4.0 / np.sqrt(2 * len(gone)) + 0.1  # the scatter is known to some 5 % itself
    kept = np.setdiff1d(np.arange(COUNT), gone)
    assert np.array_equal(found.u[kept], fits.u[kept]) and np.array_equal(found.sigma_u[kept], fits.sigma_u[kept])


def test_where_the_centres_about_a_gap_lie_to_one_side_sigma_holds_that() -> None:
    fits, centres, truth = lines()
    aside = np.arange(100, 180)
    u = centres.u.copy()
    u[aside] += 5.0 * SCATTER
    gone = np.arange(120, 160)
    found = completed(without(fits, gone, Flag.NOT_CONVERGED), replace(centres, u=u))
    ratio = np.abs(found.u[gone, 0] - truth[gone]) / found.sigma_u[gone, 0]
    assert found.valid[gone].all() and (ratio < 2.0).mean() > 0.9


def test_what_lies_off_the_line_or_is_scattered_beyond_its_ends_or_in_a_long_gap_is_not_taken() -> None:
    fits, centres, _ = lines()
    stray, gap = np.array([50, 60]), np.arange(200, 202 + GAP)
    ends = np.r_[:10, COUNT - 10 : COUNT]
    lost = np.concatenate([gap, ends])
    u = centres.u.copy()
    u[stray] += 10.0 * WIDTH
    u[lost] = np.random.default_rng(3).uniform(0.0, 600.0, (len(lost), 1))
    line = without(fits, np.concatenate([stray, lost]), Flag.REJECTED)
    found = completed(line, replace(centres, u=u))
    assert not found.valid[stray].any() and found.valid[gap].mean() < 0.2 and not found.valid[ends].any()


def test_a_smooth_chain_of_centres_carries_the_line_on_where_no_fit_does() -> None:
    fits, centres, truth = lines()
    lost = np.arange(250, COUNT)
    found = completed(without(fits, lost, Flag.NOT_CONVERGED), centres)
    assert found.valid[lost].all() and np.abs(found.u[lost, 0] - truth[lost]).max() < 5.0 * SCATTER
    # as long as enough of it is beside fits, or all of it as bright as they are
    few = without(fits, np.arange(60, COUNT), Flag.NOT_CONVERGED)
    dim = centres.amplitude.copy()
    dim[60:] = 0.3
    assert completed(few, replace(centres, amplitude=dim)).valid.sum() == 60
    assert completed(few, centres).valid.mean() > 0.99  # the chain leaves out what scatters most


def test_the_line_is_not_left_for_a_ghost_where_its_own_fit_fails() -> None:
    fits, centres, truth = lines()
    ghost = replace(fits, u=np.full((COUNT, 1), 300.0), amplitude=np.full((COUNT, 1), 0.05))
    lost = np.arange(150, 190)
    ghost = without(ghost, np.setdiff1d(np.arange(COUNT), lost), Flag.NO_PEAK)
    pairs = {
        name: np.concatenate([getattr(without(fits, lost, Flag.NOT_CONVERGED), name), getattr(ghost, name)], axis=1)
        for name in ("u", "sigma_u", "width", "amplitude", "background", "chi2", "length_apart", "flag")
    }
    candidates = replace(fits, **pairs)
    alone = select_chain(candidates)
    assert np.all(alone.u[lost] == 300.0)
    kept = without_detours(alone, select_chain(offered(candidates, centres)))
    found = completed(kept, centres)
    assert found.valid.all() and np.abs(found.u[:, 0] - truth).max() < 5.0 * SCATTER


def test_scan_lines_without_a_peak_stay_without_one() -> None:
    fits, centres, _ = lines()
    found = completed(without(fits, np.arange(100, 105), Flag.NO_PEAK), centres)
    assert np.all(found.flag[100:105] == Flag.NO_PEAK)


def test_centres_that_err_by_more_than_the_line_is_wide_complete_nothing() -> None:
    fits, centres, _ = lines()
    wild = replace(centres, u=centres.u + 20.0 * np.random.default_rng(2).standard_normal((COUNT, 1)))
    line = without(fits, np.arange(100, 105), Flag.NOT_CONVERGED)
    assert completed(line, wild) is line


def test_each_of_two_lines_is_carried_on_by_its_own_centres() -> None:
    fits, centres, truth = lines()
    settings = ExtractionSettings(select="continuous", peaks=2)
    lost = np.arange(3, COUNT - 3, 5)

    def two(line: Line, other: Line) -> Line:
        far = replace(other, u=other.u + 80.0)
        # which of them is the stronger changes from scan line to scan line
        swap = (np.arange(COUNT) % 3 == 0)[:, None]
        names = ("u", "sigma_u", "width", "amplitude", "background", "chi2", "flag", "length_apart")
        pairs = {name: np.concatenate([getattr(line, name), getattr(far, name)], axis=1) for name in names}
        return replace(line, **{name: np.where(swap, values[:, ::-1], values) for name, values in pairs.items()})

    candidates = two(without(fits, lost, Flag.NOT_CONVERGED), without(fits, lost + 1, Flag.NOT_CONVERGED))
    found = carried_on(candidates, two(centres, centres), settings, None, None)
    assert found.u.shape == (COUNT, 2) and found.valid.mean() > 0.99
    order = np.sort(found.u, axis=1) - np.stack([truth, truth + 80.0], axis=1)
    assert np.nanmax(np.abs(order)) < 6.0 * SCATTER
