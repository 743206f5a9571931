"""A tolerance is decided only where the uncertainty lets it be; what no gauge can be is refused by its field."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pydantic import ValidationError

from analysis.gauges.gauge import MISSES, Gauge
from tests.analysis.gauges.profiles import gauge


@pytest.mark.parametrize("value", [11.0, 20.0])
def test_what_the_curve_does_not_fit_is_neither_within_nor_without(value: float) -> None:
    """A measure on another part than its own was a pass by its one limit."""
    one = gauge("step", nominal=11.0, lower=-0.5, upper=0.5)
    assert one.verdict(value, 0.08, f"{MISSES}the curve") == "undecided" != one.verdict(value, 0.08, "another remark")
    assert gauge("step", nominal=11.0).verdict(value, 0.08, f"{MISSES}the curve") is None


@pytest.mark.parametrize(
    ("value", "verdict"),
    [(10.5, "undecided"), (10.7, "pass"), (11.3, "pass"), (11.4, "undecided"), (11.7, "fail"), (10.3, "fail")],
)
def test_a_verdict_needs_all_of_two_sigma_on_one_side(value: float, verdict: str) -> None:
    """Limits 10.5 and 11.5, sigma 0.08: U is 0.16."""
    assert gauge("step", nominal=11.0, lower=-0.5, upper=0.5).verdict(value, 0.08) == verdict


def test_one_limit_decides_alone_and_without_one_there_is_no_verdict() -> None:
    assert gauge("step", nominal=1.0, upper=0.1).verdict(-50.0, 0.1) == "pass"
    assert gauge("step", nominal=1.0).verdict(1.0, 0.1) is None
    assert gauge("step", nominal=1.0, upper=0.1).verdict(math.nan, 0.1) is None


def test_what_cannot_be_negative_keeps_a_lower_limit_of_zero() -> None:
    """The flatter the part, the less it was proved to be within 0 to 0.2 mm."""
    for value, verdict in ((1.8e-5, "pass"), (1.9e-4, "undecided"), (3e-4, "fail")):
        assert gauge("flatness", nominal=0.0, lower=0.0, upper=2e-4).verdict(value, 1e-5) == verdict
    assert gauge("step", nominal=0.0, lower=0.0, upper=2e-4).verdict(1e-5, 1e-5) == "undecided"
    assert gauge("radius", nominal=1e-3, lower=-1e-4, upper=2e-4).verdict(1.8e-5, 1e-5) == "fail"


def test_a_sigma_as_wide_as_the_tolerance_never_passes() -> None:
    assert gauge("step", nominal=1.0, lower=-0.1, upper=0.1).verdict(1.0, 0.06) == "undecided"


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"regions": ((0.0, 0.1),)}, "1 of them; allowed for step: 2"),
        ({"regions": ((0.0, 0.1), (0.3, 0.2))}, r"regions\[1\] goes from 0.3 m to 0.2 m"),
        ({"lower": -0.1}, "nominal, which is missing"),
        ({"nominal": 1.0, "lower": 0.2, "upper": 0.1}, "lower is 200 mm and upper 100 mm"),
        ({"nominal": math.nan}, "finite number"),
        ({"kind": "volume"}, "kind"),
    ],
)
def test_what_is_no_gauge_is_refused(values: dict[str, Any], told: str) -> None:
    whole: dict[str, Any] = {"kind": "step", "regions": ((0.0, 0.1), (0.2, 0.3))}
    with pytest.raises(ValidationError, match=told):
        Gauge(**{**whole, **values})
