"""A section that crosses faces obliquely is told as such beside the measure, with the dimension square to them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.gauges.gauge import Gauge
from analysis.gauges.profile import Profile, Section
from analysis.gauges.read import Reading, read
from render.base.pose import rotation_matrix
from tests.analysis.gauges.profiles import ACROSS, gauge, shape

LIMITS = {"nominal": math.pi / 2.0, "lower": -math.radians(0.1), "upper": math.radians(0.1)}


def through(height: np.ndarray, angle: float, sigma: float = 1e-6) -> Profile:
    """A part of that profile square to its x, in a plane that is turned by `angle` about the vertical."""
    slope = np.gradient(height, ACROSS)
    turn = rotation_matrix(np.array([0.0, 0.0, angle]))
    own = np.stack([ACROSS * math.tan(angle), ACROSS, -height], axis=1)
    normals = np.stack([np.zeros(len(slope)), slope, np.ones(len(slope))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    place, normal = own @ turn.T, normals @ turn.T
    sight = np.tile([0.0, sigma], (len(height), 1))
    others = (("In the laser's plane", turn[:, 1]), ("In a section across X", turn[:, 0]))
    return Profile(
        position=place[:, 1:] * [1.0, -1.0], random=sight, systematic=np.zeros((len(height), 2, 0)),
        index=np.arange(len(height)), correlation_length=np.ones(len(height)), place=place, normal=normal,
        section=Section("in an upright section", others),
    )  # fmt: skip


def read_through(one: Gauge, angle: float, height: np.ndarray | None = None) -> Reading:
    return read(one, 0, through(shape(one.kind)[0] if height is None else height, angle), None)


def test_a_right_joint_that_is_crossed_obliquely_fails_with_the_reason_beside_it() -> None:
    found = read_through(gauge("opening", **LIMITS), math.radians(13.0))
    # the flanks of slope 1 come out with slope cos 13 in the plane that crosses them so
    assert found.value == pytest.approx(math.pi - 2.0 * math.atan(math.cos(math.radians(13.0))), abs=1e-9)
    assert found.verdict == "fail" and found.square == pytest.approx(math.pi / 2.0, abs=1e-9)
    assert found.oblique == pytest.approx(math.radians(13.0), abs=1e-9)
    assert "13.0° obliquely: square to them it is 90.00°" in found.remark
    assert "choose “In a section across X” in the list of sections, or turn the laser" in found.remark
    assert found.section == "in an upright section"


def test_a_section_square_to_the_faces_has_nothing_beside_it() -> None:
    found = read_through(gauge("opening", **LIMITS), 0.0)
    assert found.verdict == "pass" and found.remark == "" and math.isnan(found.oblique) and math.isnan(found.square)


@pytest.mark.parametrize(
    "kind", ["angle", "opening", "width", "v_depth", "radius", "gap", "area", "thickness", "flush"]
)
def test_the_dimension_square_to_the_faces_is_that_of_the_part(kind: str) -> None:
    height, exact = shape(kind)
    turned = through(height, math.radians(20.0))
    regions = tuple((low / math.cos(0.349), high / math.cos(0.349)) for low, high in gauge(kind).regions)
    found = read(Gauge(kind=kind, regions=regions), 0, turned, None)
    changes = abs(found.value - exact) > found.sigma
    assert math.isfinite(found.square) == changes
    if changes:
        assert abs(found.square - exact) < max(0.02 * abs(found.value - exact), 5.0 * found.sigma)


def test_a_flat_face_says_how_far_a_section_leans_from_it_and_normals_of_all_sides_say_nothing() -> None:
    flat = through(-0.5 + 0.002 * (ACROSS > 0.0), 0.0)
    lean = math.radians(10.0)
    tilt = rotation_matrix(np.array([0.0, lean, 0.0]))
    leaning = replace(
        flat,
        position=flat.position / [1.0, math.cos(lean)],
        place=flat.place / [1.0, 1.0, math.cos(lean)] * [0.0, 1.0, 1.0],
        normal=np.tile([0.0, 0.0, 1.0], (len(ACROSS), 1)) @ tilt,
    )
    found = read(gauge("step"), 0, leaning, None)
    assert found.square == pytest.approx(0.002, abs=1e-8) and found.oblique == pytest.approx(lean)
    everywhere = np.random.default_rng(1).standard_normal((len(ACROSS), 3))
    rough = replace(leaning, normal=everywhere / np.linalg.norm(everywhere, axis=1, keepdims=True))
    assert read(gauge("step"), 0, rough, None).remark == ""


def ball(radius: float, aside: float, half: float, turn: float) -> tuple[Profile, float]:
    """Cut by a plane that passes its middle, over an angle on either side of its top, in a section that is turned from
    that plane; and the circle's radius."""
    circle = math.sqrt(radius**2 - aside**2)
    angle = np.linspace(-half, half, 301)
    points = np.stack([np.full(len(angle), aside), circle * np.sin(angle), -circle * np.cos(angle)], axis=1)
    about = rotation_matrix(np.array([0.0, turn, 0.0]))
    normal, place = points / radius @ about.T, points @ about.T + [0.0, 0.0, 0.6]
    flat = np.stack([place[:, 1], -place[:, 2]], axis=1)
    sight = np.tile([0.0, 1e-6], (len(angle), 1))
    return Profile(
        position=flat, random=sight, systematic=np.zeros((len(angle), 2, 0)), index=np.arange(len(angle)),
        correlation_length=np.ones(len(angle)), place=place, normal=normal,
    ), circle  # fmt: skip


@pytest.mark.parametrize("half", [0.4, 0.8, 1.2])
def test_a_ball_that_the_sheet_passes_aside_of_its_middle_is_told_with_its_own_radius(half: float) -> None:
    cut, circle = ball(0.05, 0.011247, half, 0.0)
    reach = 0.98 * circle * math.sin(half)
    found = read(Gauge(kind="radius", regions=((-reach, reach),)), 0, cut, None)
    assert found.value == pytest.approx(circle, rel=1e-6) and found.square == pytest.approx(0.05, rel=1e-6)
    assert "the sheet passes the middle of the ball by 11.2470 mm, whose own radius is 50.0000 mm" in found.remark
    assert found.oblique == pytest.approx(math.asin(0.011247 / 0.05), rel=1e-6)


def test_in_another_section_a_ball_is_no_circle_and_through_its_middle_nothing_is_said() -> None:
    gauge_of = Gauge(kind="radius", regions=((-0.03, 0.03),))
    found = read(gauge_of, 0, ball(0.05, 0.011247, 0.9, math.radians(13.0))[0], None)
    assert "round in the laser's plane alone" in found.remark and math.isnan(found.square)
    assert read(gauge_of, 0, ball(0.05, 0.0, 0.9, 0.0)[0], None).remark == ""


def test_a_photograph_has_no_normals_and_says_nothing() -> None:
    turned = replace(through(shape("opening")[0], 0.3), normal=None, place=None)
    assert read(gauge("opening"), 0, turned, None).remark == ""


def test_a_section_along_the_faces_is_said_to_show_nothing_of_them() -> None:
    square = through(shape("opening")[0], 0.0)
    quarter = rotation_matrix(np.array([0.0, 0.0, math.pi / 2.0]))
    along = replace(square, normal=square.normal @ quarter.T, place=square.place @ quarter.T)
    found = read(gauge("opening"), 0, along, None)
    assert "runs along its faces" in found.remark and math.isnan(found.square)


def test_where_the_exact_line_is_not_no_section_is_advised() -> None:
    """Stray points beside an end face had its normal, and so the advice to run the section along the profile."""
    asked = gauge("opening", **LIMITS)
    measured = through(shape("opening")[0], math.radians(13.0))
    truth = replace(measured, normal=None, place=None)
    assert "obliquely" in read(asked, 0, measured, truth).remark
    away = read(asked, 0, measured, truth.taken(np.abs(ACROSS) > 0.018))
    assert away.stray and "list of sections" not in away.remark and math.isnan(away.oblique)


def test_what_a_curve_that_does_not_fit_changes_by_is_not_said_to_be_the_sections() -> None:
    """A radius over a groove was told as 0.0 deg oblique, and 2 % less square to its faces."""
    height, _ = shape("opening")
    whole = (float(ACROSS[0]), float(ACROSS[-1]))
    found = read_through(Gauge(kind="radius", regions=(whole,)), math.radians(0.03), height)
    assert math.isfinite(found.value) and "obliquely" not in found.remark and math.isnan(found.oblique)
