"""A few outliers among many points are told where they make the RMSE, and not where they do not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from analysis.report.model import ReportInput
from analysis.report.summary import headline, remarks, tiles
from analysis.report.total import _half_by, total
from analysis.report.units import micrometres
from tests.analysis.report.test_report import extraction, make_frames, report_of

STEPS = 12
"""Scans of 100 rows each, so that one outlier is 0.08 % of the points."""


def remarks_with_outliers(outliers: int, size_px: float) -> list[str]:
    return remarks(total(with_outliers(outliers, size_px).record.chosen()))


def with_outliers(outliers: int, size_px: float) -> ReportInput:
    scene, frames = make_frames(steps=STEPS)
    noise = 0.1 * np.random.default_rng(2).standard_normal(100)
    noise[:outliers] = size_px
    laser = frames[0].lasers[0]
    changed = dataclasses.replace(laser, extractions=(extraction(scene, laser.curve, 0, "likelihood", noise),))
    frames[0] = dataclasses.replace(frames[0], lasers=(changed,))
    return report_of(scene, frames)


@pytest.mark.parametrize(
    ("outliers", "size_px", "told"),
    [(1, 20.0, "1 point is an outlier"), (2, 20.0, "2 points are outliers"), (0, 0.0, ""), (1, 1.5, "")],
)
def test_outliers_that_make_the_rmse_are_told(outliers: int, size_px: float, told: str) -> None:
    said = " ".join(remarks_with_outliers(outliers, size_px))
    assert ("outlier" in said) == bool(told)
    assert told in said


@pytest.mark.parametrize(("outliers", "few"), [(1, "1 point"), (3, "2 points")])
def test_a_report_begins_with_the_usual_error_where_outliers_make_the_rmse(outliers: int, few: str) -> None:
    """It began with an RMSE of 1265 um and a bias of a few gross outliers; 20.6 um stood small below."""
    report = with_outliers(outliers, 20.0)
    depth = (found := total(report.record.chosen())).depth_z
    first, second, third = tiles(found)[:3]
    assert first == ("Depth robust sigma", micrometres(depth.robust_sigma), "of what most points err by")
    assert second[:2] == ("Depth median", micrometres(depth.median, 2)) and micrometres(depth.bias, 2) in second[2]
    assert third == ("Depth RMSE", micrometres(depth.rmse), f"half of its square by {few}")
    assert f"most scatter by {micrometres(depth.robust_sigma)} (robust sigma)" in headline(report)


def test_the_points_that_make_the_rmse_are_counted_whether_outliers_of_the_image_or_not() -> None:
    """181 um were said to be mostly of 3 outliers; without them 164 um were left, of a hundred points at edges."""
    found = total(with_outliers(1, 20.0).record.chosen())
    (half,) = [text for text in remarks(dataclasses.replace(found, half_by=62)) if "Half of the square" in text]
    assert f"is of 62 of {found.depth_z.count:,}".replace(",", "\u202f") in half and "1 point is an outlier" not in half
    errors = np.array([9.0, -12.0, 2.0, np.nan, 0.5])
    assert [_half_by(errors), _half_by(np.array([5.0, -5.0, 5.0, 5.0])), _half_by(np.array([np.nan]))] == [1, 2, 0]


@pytest.mark.parametrize(("outliers", "size_px"), [(0, 0.0), (1, 1.5)])
def test_a_report_begins_with_the_rmse_where_all_points_make_it(outliers: int, size_px: float) -> None:
    report = with_outliers(outliers, size_px)
    names = [name for name, _, _ in tiles(total(report.record.chosen()))]
    assert names[:3] == ["Depth RMSE", "Depth bias", "Depth sigma"] and "rule" not in headline(report)


def test_a_bias_that_all_points_have_is_not_laid_to_outliers() -> None:
    """With a calibration that is off: one outlier makes less of the RMSE than what is common to all."""
    scene, frames = make_frames(steps=STEPS)
    noise = 0.6 + 0.1 * np.random.default_rng(2).standard_normal(100)
    noise[:1] = 15.0
    for i, frame in enumerate(frames):
        laser = frame.lasers[0]
        changed = dataclasses.replace(laser, extractions=(extraction(scene, laser.curve, 0, "likelihood", noise),))
        frames[i] = dataclasses.replace(frame, lasers=(changed,))
    found = total(report_of(scene, frames).record.chosen())
    said = " ".join(remarks(found))
    assert "Half of the square" not in said
    with_calibration = " ".join(remarks(dataclasses.replace(found, calibration=found.depth_z.robust_sigma)))
    assert "common to all of them" in with_calibration and "common to all of them" not in said


def test_one_false_row_is_told_as_one() -> None:
    scene, frames = make_frames(steps=STEPS)
    found = total(report_of(scene, frames).record.chosen())
    for count, told in ((1, "1 false scan line carries a point"), (2, "2 false scan lines carry a point")):
        assert any(text.startswith(told) for text in remarks(dataclasses.replace(found, false_rows=count)))


def test_false_rows_are_said_to_be_at_an_end_only_where_they_are() -> None:
    """One of five was 230 scan lines from the end of the line that all were told to be at."""
    scene, frames = make_frames(steps=STEPS)
    found = total(report_of(scene, frames).record.chosen())
    for at_ends, told in (
        (5, "centre: 5 next to an end of the line."),
        (4, "centre: 4 next to an end of the line and 1 away from it, of stray light or noise alone."),
        (0, "centre, of stray light or noise alone."),
    ):
        said = " ".join(remarks(dataclasses.replace(found, false_rows=5, false_rows_at_ends=at_ends)))
        assert told in said and said.count("end of the line") == (at_ends > 0)


def test_a_calibration_of_another_set_up_is_no_part_of_the_mean_error() -> None:
    """Points 45 mm off were put down to a calibration that tells 80 um."""
    scene, frames = make_frames(steps=STEPS)
    found = total(report_of(scene, frames).record.chosen())
    off = dataclasses.replace(found.depth_z, median=45e-3, bias=45e-3)
    said = " ".join(remarks(dataclasses.replace(found, depth_z=off, calibration=80e-6))).replace("\u00a0", " ")
    assert "a calibration that does not hold here" in said and "562 times what it tells of itself (80.0 µm" in said
    assert "common to all of them" not in said


def test_completeness_is_told_with_the_scan_lines_that_it_is_the_share_of() -> None:
    """99.8 % stood over 8,187 points of 8,192 scan lines, which is 99.9 %: outliers count as points."""
    found = total(with_outliers(2, 20.0).record.chosen())
    name, share, note = tiles(found)[-1]
    assert (name, share) == ("Complete", "99.8\u00a0%") and note == "1\u202f198 of 1\u202f200 scan lines"
