"""An area counts from its reference, by all that lies between fixed ends, and is not had where the points end."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gauges.area import area_above
from analysis.gauges.fit import Frame
from analysis.gauges.gauge import Gauge
from analysis.gauges.profile import Profile
from analysis.gauges.read import read
from tests.analysis.gauges.profiles import ACROSS, PITCH, gauge, noises, profile, shape

LEVEL = Frame(np.zeros(2), np.eye(2))


def test_its_derivative_is_that_by_differences() -> None:
    height, _ = shape("peak")
    points = profile(height, noise=noises(1, 1.0, seed=2)[0])
    region = (-0.00317, 0.00323)
    found = area_above(points, region, LEVEL)
    step = 1e-9
    for i in np.flatnonzero(found.here)[[0, 1, 7, -2, -1]]:
        for k in (0, 1):
            values = []
            for side in (step, -step):
                points.position[i, k] += side
                values.append(area_above(points, region, LEVEL).theta[0])
                points.position[i, k] -= side
            assert found.gradient[0, i, k] == pytest.approx((values[0] - values[1]) / (2.0 * step), rel=1e-4, abs=1e-9)


def test_a_ridge_counts_positive_and_a_groove_negative() -> None:
    height, _ = shape("peak")
    asked = gauge("peak").model_copy(update={"kind": "area", "regions": ((-0.02, -0.01), (-0.01, 0.01))})
    # of a parabola 3 mm high and sqrt(0.003 / 100) to either side
    exact = 4.0 / 3.0 * 0.003 * np.sqrt(0.003 / 100.0)
    assert read(asked, 0, profile(height), None).value == pytest.approx(exact, rel=1e-3)
    assert read(asked, 0, profile(-1.0 - height), None).value == pytest.approx(-exact, rel=1e-3)


def test_spikes_are_left_out_and_holes_are_bridged() -> None:
    height, exact = shape("area")
    noise = noises(1, 1.0, seed=3)[0]
    clean = read(gauge("area"), 0, profile(height, noise=noise), None)
    noise[[60, 75]] += 500.0
    spiked = read(gauge("area"), 0, profile(height, noise=noise), None)
    assert abs(spiked.value - exact) < 4.0 * spiked.sigma
    assert spiked.points == clean.points - 2
    kept = np.ones(len(ACROSS), dtype=bool)
    kept[62:73] = False
    holed = read(gauge("area"), 0, profile(height).taken(kept), None)
    assert holed.value == pytest.approx(exact, rel=1e-7)
    assert holed.remark.startswith("2.4 mm of its section carry no points") and clean.remark == "" == spiked.remark


def test_sigma_allows_for_what_is_hidden_behind_an_edge() -> None:
    """A block of 50 mm hides 4.6 mm behind it: a line over this shadow adds 115 mm2, on the exact line too.

    The area failed its tolerance by 128 mm2 with a sigma of 0.3, and agreed with a truth that was bridged alike.
    """
    x = np.arange(-100.0, 100.0, 0.25) * 1e-3
    height = -0.5 + np.where(np.abs(x) < 0.04, 0.05, 0.0)
    exact = 0.05 * (0.08 - 0.25e-3)  # its last edge is a slope between two points
    seen = ~((x >= 0.04) & (x < 0.0446))
    asked = Gauge(kind="area", regions=((-0.09, -0.05), (-0.06, 0.06)), nominal=exact, lower=-2e-5, upper=2e-5)
    whole = Profile(
        np.stack([x, height], axis=1), np.tile([0.0, 1e-6], (len(x), 1)), np.zeros((len(x), 2, 0)),
        np.arange(len(x)), np.ones(len(x)),
    )  # fmt: skip
    clear, shaded = read(asked, 0, whole, whole), read(asked, 0, whole.taken(seen), whole.taken(seen))
    assert clear.truth == pytest.approx(exact, rel=1e-7) and clear.verdict == "pass" and clear.remark == ""
    assert shaded.value - exact == pytest.approx(0.5 * 0.0046 * 0.05, rel=0.1)
    assert abs(shaded.value - exact) < 2.0 * shaded.sigma and shaded.verdict == "undecided"
    assert np.isnan(shaded.truth) and "has no truth" in shaded.remark
    # where the exact line goes on, the error is that of what was bridged
    assert read(asked, 0, whole.taken(seen), whole).error == pytest.approx(shaded.value - clear.value)


def test_points_that_are_far_less_sure_than_the_others_are_bridged() -> None:
    height, exact = shape("area")
    points = profile(height)
    clean = read(gauge("area"), 0, points, None)
    points.random[[60, 61, 75]] *= 1000.0
    reading = read(gauge("area"), 0, points, points)
    assert reading.value == pytest.approx(exact, rel=1e-7)
    assert reading.points == clean.points - 3
    assert reading.sigma < 1.05 * clean.sigma


def test_a_long_run_of_unsure_points_is_all_that_is_known_there() -> None:
    """Of a saturated line in a groove: bridged, the groove's bottom was cut off, 5 mm2 in place of 0.1 of sigma."""
    height, exact = shape("area")
    points = profile(height, noise=noises(1, 1.0, seed=3)[0])
    points.random[60:71] *= 20.0
    points.position[60:71] = profile(height).position[60:71]
    reading = read(gauge("area"), 0, points, profile(height))
    assert abs(reading.value - exact) < 4.0 * reading.sigma and reading.remark == ""


def test_the_edges_of_steps_are_no_spikes() -> None:
    """Three plates of 2 mm, 2 mm apart, and a rod of three points."""
    comb = 0.002 * ((np.abs(ACROSS) % 0.004) < 0.002) + 0.003 * (np.abs(ACROSS - 0.0125) < 0.0003)
    points = profile(comb - 0.5, noise=0.1 * noises(1, 1.0, seed=4)[0])
    within = np.count_nonzero(np.abs(ACROSS - 0.0019) < 0.012)
    # and one beyond each end
    assert np.count_nonzero(area_above(points, (-0.0101, 0.0139), LEVEL).here) == within + 2


def test_a_section_that_goes_on_where_points_end_has_no_area() -> None:
    height, _ = shape("area")
    beyond = gauge("area").model_copy(update={"regions": ((0.012, 0.02), (-0.02 - 20.0 * PITCH, -0.002))})
    reading = read(beyond, 0, profile(height), profile(height))
    assert reading.reason == "its points end before the section does"
    assert np.isnan(reading.value) and np.isnan(reading.truth)
