"""What is said beside a measure's verdict."""

from __future__ import annotations

import math

import pytest

from analysis.gauges.gauge import LEFT_OUT, MISSES, Gauge
from analysis.gauges.read import AS_DRAGGED, Reading
from analysis.report.gauge_table import beside_nominal, label_of

STEP = Gauge(name="Step", kind="step", regions=((0.0, 0.01), (0.02, 0.03)), nominal=0.01, lower=-1e-4, upper=1e-4)
RADIUS = Gauge(name="Radius", kind="radius", regions=((0.0, 0.01),), nominal=0.01)


@pytest.mark.parametrize(("value", "told"), [(-0.010004, True), (0.010004, False), (-0.008, False), (None, False)])
def test_a_nominal_with_the_other_sign_is_no_plain_failure(value: float | None, told: bool) -> None:
    said = beside_nominal(STEP, value)
    assert said.startswith("The value is the nominal with the other sign: it counts from the lower side") == told
    assert told or not said


def test_of_one_region_nothing_is_counted_from_one_to_the_other() -> None:
    assert "it counts" not in beside_nominal(RADIUS, -0.01) and "other sign" in beside_nominal(RADIUS, -0.01)


@pytest.mark.parametrize(
    ("oblique", "remark", "told"),
    [
        (math.nan, "", "Step: 10.0000 mm, ✓ pass"),
        (math.radians(13.0), "", "Step: 10.0000 mm, ✓ pass, 13.0° oblique"),
        (math.nan, f"its {MISSES}the curve by 5 µm", "Step: 10.0000 mm, ? undecided, misfit"),
        (math.nan, f"12 of 90 {LEFT_OUT}", "Step: 10.0000 mm, ✓ pass, points left out"),
        (math.nan, f"{MISSES}it; {AS_DRAGGED}", "Step: 10.0000 mm, ? undecided, misfit, as dragged"),
    ],
)
def test_where_a_reading_is_drawn_it_says_what_is_amiss_with_it(oblique: float, remark: str, told: str) -> None:
    """A radius of 48.7 mm stood as a plain pass beside the table's "13.0° oblique"."""
    one = Reading(STEP, 0, value=0.01, sigma_random=1e-6, sigma_systematic=0.0, oblique=oblique, remark=remark)
    assert label_of(one).replace("\u00a0", " ") == told
    plain = Reading(RADIUS.model_copy(update={"nominal": None}), 0, value=0.01, sigma_random=1e-6, sigma_systematic=0.0)
    assert label_of(plain).replace("\u00a0", " ") == "Radius: 10.0000 mm"
