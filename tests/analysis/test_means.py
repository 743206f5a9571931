"""Means over neighbouring scan lines, whose errors are alike: their predicted sigma against drawn errors."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.measures import means, shared_rows
from analysis.report.sample import ROW
from analysis.report.terms import TERM_COLUMNS, term_rows


def alike(rows: int, r: float, seed: int = 0) -> np.ndarray:
    """Normal errors of variance 1 whose correlation falls by r from line to line."""
    rng = np.random.default_rng(seed)
    errors = rng.normal(size=rows)
    for i in range(1, rows):
        errors[i] = r * errors[i - 1] + np.sqrt(1.0 - r * r) * errors[i]
    return errors


def alone(index: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Scan lines of which none has anything in common: which do, where they are, and their ranks."""
    return np.zeros(len(index), np.bool_), index, np.zeros_like(index)


@pytest.mark.parametrize("count", [10, 100])
def test_what_lasts_is_as_large_in_a_mean_as_in_one(count):
    """And what a width in common costs is less, the farther apart the lines are."""
    rows, sigma = 400 * count, np.full(400 * count, 2.0)
    index = np.arange(rows)
    given = sigma, np.ones(rows), sigma
    found, told = means(sigma, *given, np.ones(rows, np.bool_), *alone(index)[1:], count)
    np.testing.assert_allclose(told, 2.0)
    np.testing.assert_allclose(found, 2.0)
    _, narrow = means(sigma, *given, *alone(index), count)
    lags = np.abs(np.arange(count)[:, None] - np.arange(count))
    np.testing.assert_allclose(narrow**2, 4.0 * np.maximum(1.0 - lags / 65.0, 0.0).mean())


@pytest.mark.parametrize("count", [10, 100])
@pytest.mark.parametrize("r", [0.0, 0.3, 0.8])
def test_means_scatter_as_their_correlation_length_says(r, count):
    rows = 400 * count
    index = np.arange(rows)
    length = np.full(rows, (1.0 + r) / (1.0 - r))
    found, told = means(alike(rows, r), np.ones(rows), length, np.zeros(rows), *alone(index), count)
    assert len(found) == 400
    np.testing.assert_allclose(np.mean(found**2), np.mean(told**2), rtol=4 * np.sqrt(2 / 400))


def test_of_one_row_and_of_independent_rows_nothing_is_shared():
    np.testing.assert_allclose(shared_rows(np.array([1.0, 3.0, 20.0]), 1), 1.0)
    np.testing.assert_allclose(shared_rows(np.ones(3), 50), 1.0)
    np.testing.assert_allclose(shared_rows(np.full(1, 5.0), 100_000), 5.0, rtol=1e-3)


def test_only_runs_without_a_gap_and_their_strongest_peaks_count():
    index = np.array([0, 1, 2, 3, 3, 5, 6, 8, 9, 10, 11])  # 4 and 7 are missing, 3 has two peaks
    rank = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0])
    error = np.array([1.0, 2.0, 3.0, 99.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0])
    found, told = means(error, np.ones(11), np.ones(11), np.zeros(11), np.zeros(11, np.bool_), index, rank, 4)
    np.testing.assert_allclose(found, (2.5, 8.5))
    np.testing.assert_allclose(told, 0.5)


def test_the_report_tells_cover_by_term():
    rows = np.zeros(4000, ROW)
    rng = np.random.default_rng(2)
    rows["index"], rows["alike"] = np.arange(4000), 1.0
    rows["sigma_depth"], rows["sigma_systematic"] = 3e-5, 4e-5
    rows["depth"] = rng.normal(0.0, 3e-5, 4000) + 4e-5
    told = dict(term_rows(rows))
    both = dict(zip(TERM_COLUMNS, told["noise and calibration"], strict=True))
    alone = dict(zip(TERM_COLUMNS, told["each point: noise"], strict=True))
    assert both["sigma, RMS"].startswith("50") and alone["sigma, RMS"].startswith("30")
    # an offset of 4/3 sigma: the normal distribution between -2 - 4/3 and 2 - 4/3
    assert float(alone["within ±2 sigma"].split()[0]) == pytest.approx(74.7, abs=3 * 0.7)
    assert told["mean of 100 scan lines: noise"][0] == "40"
    rows["sigma_systematic"] = 0.0
    assert [name for name, _ in term_rows(rows)] == [
        "each point: noise",
        "mean of 10 scan lines: noise",
        "mean of 100 scan lines: noise",
    ]


def test_the_report_tells_what_the_sheet_adds_where_it_matters():
    rows = np.zeros(4000, ROW)
    rng = np.random.default_rng(3)
    rows["index"], rows["alike"], rows["sigma_depth"], rows["pixel_depth"] = np.arange(4000), 1.0, 3e-5, 1e-3
    rows["sheet_bias"] = np.where(np.arange(4000) < 2000, 0.1, np.nan)  # px, 100 um
    rows["depth"] = rng.normal(0.0, 3e-5, 4000) + 1e-3 * np.nan_to_num(rows["sheet_bias"])
    told = dict(term_rows(rows))
    number, size = told["sheet's own width, from the truth"][:2]
    assert number.split() == ["2", "000"] and size.split() == ["100", "µm"]
    cells = dict(zip(TERM_COLUMNS, told["noise, calibration and sheet"], strict=True))
    assert float(cells["within ±2 sigma"].split()[0]) == pytest.approx(
        97.7, abs=0.7
    )  # half of them always, half 95.4 %
    rows["sheet_bias"] *= 0.01
    assert "noise, calibration and sheet" not in dict(term_rows(rows))
