"""What the predicted sigma is made of, and how well each part of it holds against the truth."""

from __future__ import annotations

import numpy as np

from analysis.line.result import SYSTEMATIC
from analysis.measures import means
from analysis.report.model import ReportInput
from analysis.report.sample import Rows
from analysis.report.units import NONE, count, micrometres, percent

TERM_COLUMNS = ("n", "sigma, median", "sigma, RMS", "true RMSE", "within ±1 sigma", "within ±2 sigma")
MEANS = (10, 100)
"""Numbers of neighbouring scan lines over which means are taken."""
LEAST = 0.1
"""Of the noise; a bias below it is not worth a row."""


def term_tables(report: ReportInput) -> list[tuple[str, list[tuple[str, list[str]]]]]:
    """By laser, its name and rows in the order of `TERM_COLUMNS`, of depth_z by the first method."""
    tables = []
    for i, laser in enumerate(report.scene.lasers):
        if report.record.method_count(i):
            tables.append((laser.name, term_rows(report.record.chosen(i, 0).rows)))
    return tables


def term_rows(rows: Rows) -> list[tuple[str, list[str]]]:
    """Noise of one point, of means over neighbours, the calibration, what the truth predicts of the sheet's own width,
    and all that a point's error is made of together."""
    error, random, systematic = rows["depth"], rows["sigma_depth"], rows["sigma_systematic"]
    sheet = np.abs(rows["sheet_bias"]) * rows["pixel_depth"]
    of_lines = rows["alike"], rows["shared"], np.isin(rows["flag"], SYSTEMATIC), rows["index"], rows["rank"]
    told = [("each point: noise", _cells(error, random))]
    for number in MEANS:
        told.append(
            (
                f"mean of {number} scan lines: noise",
                _cells(*means(error, random, *of_lines, number)),
            )
        )
    if np.any(systematic > 0.0):
        known = systematic[np.isfinite(error) & np.isfinite(systematic)]
        told.append(("calibration, common to all", [count(len(known)), *_sizes(known), *[NONE] * 3]))
        told.append(("noise and calibration", _cells(error, np.hypot(random, systematic))))
    if _rms(np.nan_to_num(sheet)) > LEAST * _rms(np.nan_to_num(random)):
        known = sheet[np.isfinite(error) & np.isfinite(sheet)]
        told.append(("sheet's own width, from the truth", [count(len(known)), *_sizes(known), *[NONE] * 3]))
        all_of_it = np.hypot(np.hypot(random, systematic), np.nan_to_num(sheet))
        told.append(("noise, calibration and sheet", _cells(error, all_of_it)))
    return told


def _cells(error: np.ndarray, sigma: np.ndarray) -> list[str]:
    known = np.isfinite(error) & np.isfinite(sigma)
    if not known.any():
        return [count(0), *[NONE] * (len(TERM_COLUMNS) - 1)]
    e, s = np.abs(error[known]), sigma[known]
    return [
        count(len(e)),
        *_sizes(s),
        micrometres(_rms(e)),
        percent(float(np.mean(e <= s))),
        percent(float(np.mean(e <= 2.0 * s))),
    ]


def _sizes(sigma: np.ndarray) -> tuple[str, str]:
    """Median, and root of the mean squares, which is that of the squared errors but hangs on the few least sure."""
    return micrometres(float(np.median(sigma)) if len(sigma) else 0.0), micrometres(_rms(sigma))


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
