"""A scan in words: totals over frames and lasers, the headline, and what a reader should notice."""

from __future__ import annotations

import numpy as np

from analysis.line.result import Flag
from analysis.report.colour import method_name
from analysis.report.model import ReportInput
from analysis.report.total import Total, total
from analysis.report.units import count, micrometres, percent, pixels

ENOUGH = 30
"""Fewer points than this are no statistics to draw a conclusion from."""


def headline(report: ReportInput) -> str:
    """The result in one paragraph of plain words."""
    found = total(report.record.chosen())
    frames, lasers = len(report.record.steps), len(report.scene.lasers)
    where = f"in {frames} frames" if frames > 1 else "in one frame"
    who = "one laser" if lasers == 1 else f"{lasers} lasers"
    if found.truth_rows == 0:
        return (
            f"Nothing was measured: {who} drew no line that the camera could see {where}. "
            "Either the sheet misses the part, or the part hides the line from the camera."
        )
    if found.depth_z.count == 0:
        return (
            f"Nothing was measured: the camera could see the line on {count(found.truth_rows)} scan lines {where}, but "
            f"none was found by {method_name(found.method)}. The line may be too faint, or the threshold too high."
        )
    depth = found.depth_z
    side = "too far from" if depth.bias > 0 else "too near to"
    return (
        f"The line of {who} could be seen on {count(found.truth_rows)} scan lines {where}; "
        f"{count(found.measured_rows)} of them ({percent(found.completeness)}) were measured by "
        f"{method_name(found.method)}. Against exact ground truth the depth is on average "
        f"{micrometres(abs(depth.bias), 2)} {side} the camera (bias) and scatters about that by "
        f"{micrometres(depth.sigma)} (standard deviation), {micrometres(depth.rmse)} in all (RMSE). "
        f"95 % of the points{' in a sample' if found.sampled else ''} lie within {micrometres(found.surface.p95)} of "
        "the true surface."
    )


def remarks(report: ReportInput) -> list[str]:
    """What the numbers say beyond themselves, one sentence or two each; empty when all is as it should be."""
    chosen = report.record.chosen()
    found = total(chosen)
    if found.truth_rows == 0 or found.depth_z.count < ENOUGH:
        return []
    said = []
    if found.completeness < 0.95:
        missed = found.truth_rows - found.measured_rows
        said.append(
            f"{count(missed)} scan lines on which the line can be seen ({percent(missed / found.truth_rows)}) have no "
            "right measurement: the line there is too faint, cut, or overlaid."
        )
    if found.false_rows:
        said.append(
            f"{count(found.false_rows)} scan lines carry a point although no line crosses their centre, at the ends of "
            "the line or from stray light. Their distance from the surface counts, their depth has no truth."
        )
    if found.u.outlier_rate > 0.002:
        said.append(
            f"{percent(found.u.outlier_rate)} of the points are outliers, wrong by more than a pixel and five times "
            "the usual error: a wrong peak, or an edge. They dominate the RMSE; the robust sigma leaves them out."
        )
    if abs(found.u.bias) > max(0.3 * found.u.robust_sigma, 5 * found.u.sigma / np.sqrt(found.u.count)):
        said.append(
            f"The line's position has a bias of {pixels(found.u.bias)} that the scatter does not explain; averaging "
            "will not remove it."
        )
    if found.u.coverage < 0.88:
        said.append(
            f"Only {percent(found.u.coverage)} of the errors lie within ±2 predicted sigma, where noise alone would "
            "put 95.4 %. Something else moves the line as well: texture or edges under it, or too few pixels."
        )
    if found.u.autocorrelation > 0.3:
        said.append(
            f"Neighbouring scan lines err alike (correlation {found.u.autocorrelation:.2f}): the cause is "
            "rather the surface's texture or shape than the sensor's noise, and averaging along the line gains little."
        )
    width, flag = chosen.rows["width"], chosen.rows["flag"]
    width = width[np.isfinite(width)]
    narrow = float(np.mean(width < 0.4)) if len(width) else 0.0
    if narrow > 0.1:
        said.append(
            f"On {percent(narrow, 0)} of the points the line is narrower than 0.4 px (sigma): too narrow for the "
            "pixels, so that the measured position depends on where within a pixel the line falls."
        )
    saturated = float(np.mean(flag == Flag.SATURATED)) if len(flag) else 0.0
    if saturated > 0.02:
        said.append(f"{percent(saturated)} of the peaks are saturated and were measured from what is left of them.")
    return said


def sample_note(found: Total) -> str:
    """Which figures come from how large a sample; empty: all points are in it."""
    if not found.sampled:
        return ""
    return (
        f"Robust sigma, P95, outliers, lag 1 and the share of narrow or saturated peaks are those of a sample of "
        f"{count(found.lines_kept)} of the {count(found.lines)} scan lines, drawn by chance; n, bias, sigma, RMSE, the "
        "share within ±2 sigma and the counts of scan lines are of all."
    )
