"""A scan in words: totals over frames and lasers, the headline, and what a reader should notice."""

from __future__ import annotations

import numpy as np

from analysis import measures
from analysis.report.colour import method_name
from analysis.report.model import ReportInput
from analysis.report.total import NARROW_PX, Total, total
from analysis.report.units import count, counted, grouped, micrometres, percent, pixels

ENOUGH = 30
"""Least number of points from which a conclusion is drawn."""
SHEET_PX = 0.01
"""Bias by the sheet's width, px, above which it is mentioned: the uncertainty of a good line."""
SURELY = 6.0
"""Sigmas that most points are off together from which on their calibration is told to be of another set-up."""
TOLD_OF_NOISE = 0.3
"""Of the robust sigma, from which on the calibration's error is told."""
WRONG = "wrong by more than a pixel, and five times the usual error or half the line's width"
"""Of outliers."""
LITTLE = 0.5
"""Completeness below which the errors describe chance finds rather than the line."""


def headline(report: ReportInput) -> str:
    """The result in one paragraph of plain words."""
    found = total(report.record.chosen())
    frames, lasers = len(report.record.steps), len(report.scene.lasers)
    where = f"in {frames} frames" if frames > 1 else "in one frame"
    who = "one laser" if lasers == 1 else f"{lasers} lasers"
    if found.truth_rows == 0:
        false = f" {_found_without_a_line(found.false_alarms)}." if found.false_alarms else ""
        return (
            f"Nothing was measured: {who} drew no line that the camera could see {where}. "
            "Either the laser is off, or its sheet misses the part, or the part hides the line from the camera."
            f"{false}"
        )
    if found.measured_rows == 0:
        stray = f" The {count(found.points)} points are stray light or noise." if found.points else ""
        return (
            f"Nothing was measured: the camera could see the line on {count(found.truth_rows)} scan lines {where}, but "
            f"none was found by {method_name(found.method)}. The line may be too faint, or the threshold too high."
            f"{stray}"
        )
    depth = found.depth_z
    side = "too far from" if depth.bias > 0 else "too near to"
    return (
        f"The line of {who} could be seen on {count(found.truth_rows)} scan lines {where}; "
        f"{count(found.measured_rows)} of them ({percent(found.completeness)}) were rightly measured by "
        f"{method_name(found.method)}. Against exact ground truth the depth is on average "
        f"{micrometres(abs(depth.bias), 2)} {side} the camera (bias) and scatters about that by "
        f"{micrometres(depth.sigma)} (standard deviation), {micrometres(depth.rmse)} in all (RMSE)"
        f"{_without_outliers(found)}. "
        f"95 % of the points{' in a sample' if found.sampled else ''} lie within {micrometres(found.surface.p95)} of "
        "the true surface, as distances from it and not depths."
    )


def _without_outliers(found: Total) -> str:
    """What the figures of an opening sentence would be, where a few points make them."""
    if not ruled(found):
        return ""
    return f"; a few points rule these: most scatter by {micrometres(found.depth_z.robust_sigma)} (robust sigma)"


def ruled(found: Total) -> bool:
    """A few points make the RMSE of the depth."""
    return measures.ruled(found.depth_z.rmse, found.depth_z.median, found.depth_z.robust_sigma)


def tiles(found: Total) -> list[tuple[str, str, str]]:
    """Name, value and note of the figures that a report begins with; those without outliers first, where these rule."""
    if found.measured_rows == 0:
        return []
    depth, of_sample = found.depth_z, " (sample)" if found.sampled else ""
    if ruled(found):
        spread = [
            ("Depth robust sigma", micrometres(depth.robust_sigma), f"of what most points err by{of_sample}"),
            ("Depth median", micrometres(depth.median, 2), f"+ is too far; mean {micrometres(depth.bias, 2)}"),
            ("Depth RMSE", micrometres(depth.rmse), f"half of its square by {counted(found.half_by, 'point')}"),
        ]
    else:
        spread = [
            ("Depth RMSE", micrometres(depth.rmse), f"{found.u.rmse:.3f} px in the image"),
            ("Depth bias", micrometres(depth.bias, 2), "+ is too far"),
            ("Depth sigma", micrometres(depth.sigma), f"robust {micrometres(depth.robust_sigma)}{of_sample}"),
        ]
    of_lines = f"{count(found.measured_rows)} of {count(found.truth_rows)} scan lines"
    return [
        *spread,
        ("Off the surface", micrometres(found.surface.p95), f"95 % are nearer{of_sample}"),
        ("Complete", percent(found.completeness), of_lines),
    ]


def scale_head(image_scale: float) -> str:
    """The one sentence above figures that were measured at another image scale; empty at the scanner's own."""
    if image_scale == 1.0:
        return ""
    return f"Measured at image scale {image_scale:.3g}: not the scanner's figures."


def scale_note(image_scale: float) -> str:
    """What figures at another image scale than the scanner's are worth; empty at its own."""
    if image_scale == 1.0:
        return ""
    times = 1.0 / image_scale
    each = (
        f"Each pixel is {times:.3g} times as large there, exposed for 1/{times**2:.3g} of the time; full"
        if times > 1.0
        else "Full"
    )
    return f"{scale_head(image_scale)} {each} size (image scale 1) gives those."


def little_found(completeness: float | None, points: int, false: int = 0, name: str = "") -> str:
    """That less than half of the line was found; empty where it was.

    completeness: None: there was no line; false: scan lines with a position and no line; name: of the laser.
    """
    who = f"{name}: " if name else ""
    stray = f"; the {points} points are stray light or noise" if points else ""
    if completeness is None or np.isnan(completeness):
        told = f". {_found_without_a_line(false)}" if false else stray
        return f"{who}No line is lit and seen, so that nothing was measured{told}."
    if completeness == 0.0:
        return f"{who}Nothing of the line was found{stray}."
    if completeness >= LITTLE:
        return ""
    return (
        f"{who}Only {completeness:.1%} of the line was found. The errors are those of the points that there are, "
        "wrong peaks among them: they say little of the scanner."
    )


def remarks(found: Total, image_scale: float = 1.0) -> list[str]:
    """What the numbers say beyond themselves, one sentence or two each; empty when all is as it should be.

    found: of one laser or all, of a frame or a whole scan; image_scale: at which it was measured.
    """
    missing = little_found(found.completeness, found.points, found.false_alarms)
    said = [text for text in (missing, scale_note(image_scale)) if text]
    if found.truth_rows == 0 or found.depth_z.count < ENOUGH:
        return said
    if LITTLE <= found.completeness < 0.95:
        missed = found.truth_rows - found.measured_rows
        said.append(
            f"{counted(missed, 'scan line')} on which the line can be seen ({percent(missed / found.truth_rows)}) "
            f"{'has' if missed == 1 else 'have'} no right measurement: the line there is too faint, cut, or overlaid."
        )
    if found.false_rows:
        said.append(_of_false_rows(found.false_rows, found.false_rows_at_ends))
    if found.depthless_rows:
        carry = "carries" if found.depthless_rows == 1 else "carry"
        said.append(
            f"{counted(found.depthless_rows, 'false scan line')} {carry} a peak whose ray gives no depth, and so no "
            "point: it is of stray light or noise."
        )
    dominated = ruled(found)
    if found.u.outlier_rate > 0.002:
        said.append(
            f"{percent(found.u.outlier_rate)} of the points are outliers in the image, {WRONG}: a wrong peak, "
            "or an edge. The robust sigma leaves them out."
        )
    elif found.outliers and dominated:
        few = "1 point is an outlier" if found.outliers == 1 else f"{count(found.outliers)} points are outliers"
        said.append(f"{few}, {WRONG}.")
    if dominated:
        said.append(
            f"Half of the square of the RMSE of {micrometres(found.depth_z.rmse)} is of {count(found.half_by)} of "
            f"{counted(found.depth_z.count, 'point')}, those with the largest errors, as at edges or of wrong peaks; "
            f"most err by {micrometres(found.depth_z.robust_sigma)} (robust sigma)."
        )
    off, allowed = abs(found.depth_z.median), SURELY * np.hypot(found.calibration, found.depth_z.robust_sigma)
    if found.calibration > 0.0 and off > allowed:
        said.append(
            f"Points were made with a calibration that does not hold here: half of them are off by "
            f"{micrometres(off)} in depth or more, {grouped(off / found.calibration)} times what it tells of itself "
            f"({micrometres(found.calibration)}, one sigma). It was made before the camera, its lens or the laser was "
            "changed, or of another scanner: calibrate again, or take it out of the project."
        )
    elif found.calibration > TOLD_OF_NOISE * found.depth_z.robust_sigma:
        said.append(
            f"Points were made with a calibration, whose own error is common to all of them: "
            f"{micrometres(found.calibration)} in depth as it is told (one sigma, median). The mean error of "
            f"{micrometres(found.depth_z.bias, 2)} holds it, which averaging does not remove."
        )
    if abs(found.u.bias) > max(0.3 * found.u.robust_sigma, 5 * found.u.sigma / np.sqrt(found.u.count)):
        said.append(
            f"The line's position has a bias of {pixels(found.u.bias)} that the scatter does not explain; averaging "
            "will not remove it."
        )
    if found.sheet_bias[1] > SHEET_PX:
        said.append(
            f"The sheet's own width moves the line by {pixels(found.sheet_bias[0])} RMS, on 5 % of the points by more "
            f"than {pixels(found.sheet_bias[1])}: on bent surfaces and at edges the light of a wide sheet is not "
            "centred on its middle. It is systematic, told of each point in the column sheet_bias of the table, and "
            "less with a narrower sheet."
        )
    if found.u.coverage < 0.88:
        said.append(
            f"Only {percent(found.u.coverage)} of the errors lie within ±2 predicted sigma, where noise alone would "
            "put 95.4 %. Something else moves the line as well: texture or edges under it, or too few pixels."
        )
    if found.u.autocorrelation > 0.3:
        cause = "the surface's texture or shape, or smoothing along the line"
        if found.narrow > 0.1:
            cause = "where within a pixel so thin a line falls, which neighbours have in common, or the surface"
        said.append(
            f"Neighbouring scan lines err alike (correlation {found.u.autocorrelation:.2f}): the cause is rather "
            f"{cause}, than the sensor's noise, and averaging along it gains little."
        )
    if found.narrow > 0.1:
        said.append(
            f"On {percent(found.narrow, 0)} of the points the line is narrower than {NARROW_PX} px (sigma): too narrow "
            "for the pixels, so that the measured position depends on where within a pixel the line falls."
        )
    if found.saturated > 0.02:
        said.append("Saturated peaks were measured from what is left of them.")  # how many is counted in the image
    return said


def _found_without_a_line(false: int) -> str:
    return f"What was found on {counted(false, 'false scan line')} is stray light or noise"


def _of_false_rows(false: int, at_ends: int) -> str:
    """at_ends: those of them next to an end of the line."""
    away = f"{count(false - at_ends)} away from it, of stray light or noise alone"
    where = ", of stray light or noise alone" if at_ends == 0 else f": {count(at_ends)} next to an end of the line"
    where += f" and {away}" if 0 < at_ends < false else ""
    carry, their = ("carries", "its") if false == 1 else ("carry", "their")
    return (
        f"{counted(false, 'false scan line')} {carry} a point although no line crosses {their} centre"
        f"{where}. What distance from the surface such a point has counts; its depth has no truth."
    )


def sample_note(found: Total) -> str:
    """Which figures come from how large a sample; empty: all points are in it."""
    if not found.sampled:
        return ""
    return (
        f"Robust sigma, P95, outliers, lag 1 and the share of narrow lines are those of a sample of "
        f"{count(found.lines_kept)} of the {count(found.lines)} scan lines, drawn by chance; n, bias, sigma, RMSE, the "
        "share within ±2 sigma and the counts of scan lines are of all."
    )
