"""A few outliers among many points are told where they make the RMSE, and not where they do not."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from analysis.report.summary import remarks
from analysis.report.total import total
from tests.analysis.report.test_report import extraction, make_frames, report_of

STEPS = 12
"""Scans of 100 rows each, so that one outlier is 0.08 % of the points."""


def remarks_with_outliers(outliers: int, size_px: float) -> list[str]:
    scene, frames = make_frames(steps=STEPS)
    noise = 0.1 * np.random.default_rng(2).standard_normal(100)
    noise[:outliers] = size_px
    laser = frames[0].lasers[0]
    changed = dataclasses.replace(laser, extractions=(extraction(scene, laser.curve, 0, "likelihood", noise),))
    frames[0] = dataclasses.replace(frames[0], lasers=(changed,))
    return remarks(total(report_of(scene, frames).record.chosen()))


@pytest.mark.parametrize(
    ("outliers", "size_px", "told"),
    [(1, 20.0, "1 point is an outlier"), (2, 20.0, "2 points are outliers"), (0, 0.0, ""), (1, 1.5, "")],
)
def test_outliers_that_make_the_rmse_are_told(outliers: int, size_px: float, told: str) -> None:
    said = " ".join(remarks_with_outliers(outliers, size_px))
    assert ("outlier" in said) == bool(told)
    assert told in said
