"""What is told of a scan line is true also where a peak has no depth."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from analysis.triangulate import PointFlag
from studio.qt.results.scan_line_reading import UNMEASURED, reading
from studio.scan.result_series import ERROR_VIEWS
from studio.scan.stages import Measurement


def peak(flag: PointFlag, depth: float, error: float) -> dict[str, Measurement]:
    points = SimpleNamespace(index=np.array([1783]), depth_z=np.array([depth]), flag=np.array([flag], dtype=np.uint8))
    value = np.array([error])
    errors = SimpleNamespace(depth=value, off_surface=value, position=value)
    return {"likelihood": cast(Measurement, SimpleNamespace(points=points, errors=errors))}


@pytest.mark.parametrize("flag", [flag for flag in PointFlag if flag != PointFlag.OK])
def test_a_peak_without_depth_says_why(flag: PointFlag) -> None:
    """There stood "nan mm (no truth here)"."""
    text, error = reading(1783, peak(flag, np.nan, np.nan), ERROR_VIEWS[0], "rows")
    assert "no depth: the " in text and "nan" not in text and error is None


def test_a_point_is_told_with_its_error_or_that_no_truth_is_there() -> None:
    assert "675.000 mm (no truth here)" in reading(1783, peak(PointFlag.OK, 0.675, np.nan), ERROR_VIEWS[0], "rows")[0]
    text, error = reading(1783, peak(PointFlag.OK, 0.675, 2e-5), ERROR_VIEWS[0], "rows")
    assert "675.000 mm (+20" in text and error == pytest.approx(20.0)
    text, error = reading(1783, peak(PointFlag.OK, 0.675, -0.5), ERROR_VIEWS[0], "rows")
    assert "675.000 mm (-500 mm)" in text and error == pytest.approx(-500_000.0), (
        "told in mm, marked in the view's unit"
    )


def test_of_what_is_not_measured_yet_nobody_knows_that_it_has_no_point() -> None:
    assert reading(390, {}, ERROR_VIEWS[0], "rows")[0].endswith("no point")
    assert reading(390, {}, ERROR_VIEWS[0], "rows", UNMEASURED)[0].endswith("not measured yet")
