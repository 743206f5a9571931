"""What is said beside a measure's verdict."""

from __future__ import annotations

import pytest

from analysis.gauges.gauge import Gauge
from analysis.report.gauge_table import beside_nominal

STEP = Gauge(name="Step", kind="step", regions=((0.0, 0.01), (0.02, 0.03)), nominal=0.01, lower=-1e-4, upper=1e-4)
RADIUS = Gauge(name="Radius", kind="radius", regions=((0.0, 0.01),), nominal=0.01)


@pytest.mark.parametrize(("value", "told"), [(-0.010004, True), (0.010004, False), (-0.008, False), (None, False)])
def test_a_nominal_with_the_other_sign_is_no_plain_failure(value: float | None, told: bool) -> None:
    said = beside_nominal(STEP, value)
    assert said.startswith("The value is the nominal with the other sign: it counts from the lower side") == told
    assert told or not said


def test_of_one_region_nothing_is_counted_from_one_to_the_other() -> None:
    assert "it counts" not in beside_nominal(RADIUS, -0.01) and "other sign" in beside_nominal(RADIUS, -0.01)
