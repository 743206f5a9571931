"""A breakdown is named by what takes the most rows, or else by what became of the line."""

from __future__ import annotations

import pytest

from analysis.study.cause import cause

GOOD = {
    "visible_rows": 1.0, "no_peak_rows": 0.01, "saturated_rows": 0.0, "wrong_rows": 0.0, "false_rows": 0.0,
    "unmeasured_rows": 0.01, "line_width": 1.5, "signal": 1000.0, "position_rmse": 0.1, "calibration_rmse": 1e-5,
    "background": 20.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({"no_peak_rows": 0.3}, "starved"),
        ({"saturated_rows": 0.9, "no_peak_rows": 0.1}, "saturated"),
        # a plane exposed so long that it is as bright as the line on it, as measured
        ({"saturated_rows": 0.19, "no_peak_rows": 0.67, "wrong_rows": 0.09, "signal": 10000.0}, "saturated"),
        ({"wrong_rows": 0.2, "false_rows": 0.2, "saturated_rows": 0.3}, "wrong peak"),
        ({"visible_rows": 0.4}, "occluded"),
        ({"unmeasured_rows": 0.5}, "not measurable"),
        ({"unmeasured_rows": 0.5, "background": 400.0}, "too much other light"),
        # what a fit takes for light beneath a line that is as wide as its window
        ({"line_width": 4.0, "background": 400.0, "signal": 300.0}, "out of focus or too wide"),
        ({"unmeasured_rows": 0.9, "background": 200.0, "signal": 20.0}, "out of focus or too wide"),
        # brighter all together, as by a longer exposure
        ({"unmeasured_rows": 0.5, "background": 400.0, "signal": 10000.0}, "not measurable"),
        ({"line_width": 4.0}, "out of focus or too wide"),
        ({"signal": 100.0}, "starved"),
        ({"line_width": 0.8}, "too thin for the pixels"),
        ({"calibration_rmse": 1e-4}, "degenerate"),
        ({"calibration_rmse": 1e-4, "position_rmse": 2.0}, "less precise"),
        ({}, "less precise"),
    ],
)
def test_the_largest_symptom_names_the_cause(changed: dict[str, float], expected: str) -> None:
    assert cause(GOOD, {**GOOD, **changed}) == expected


def test_what_noise_makes_a_fit_take_for_light_beneath_the_line_drowns_it_not() -> None:
    """In the dark a large read noise was called other light: 0.1 e- beneath the line had become 2."""
    dark = {**GOOD, "background": 0.1, "signal": 3000.0}
    assert cause(dark, {**dark, "background": 2.0, "position_rmse": 0.5}) == "less precise"
