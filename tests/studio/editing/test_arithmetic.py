"""Expressions in a number's field give the value that they have by hand, and nothing else is taken for one."""

from __future__ import annotations

import pytest

from render.base.errors import InputError
from studio.editing.units import DEGREES, Unit

LENGTH, ANGLE = Unit.of("m"), Unit.of("rad")


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("150+25", 0.175),
        ("1 in", 0.0254),
        ("1 in + 2 mm", 0.0274),
        ("1 in + 2", 0.0274),
        ("2*(1 in - 3 mm)", 0.0448),
        ("-3*-2", 0.006),
        ("100/8/2", 0.00625),
        ("10 - 4 - 3", 0.003),
        ("2+3*4", 0.014),
        ("1,5+1.5", 0.003),
        ("1e2 + 1e-1", 0.1001),
        ("0.2 m/4", 0.05),
        ("(150)", 0.15),
    ],
)
def test_an_expression_is_worked_out_in_the_units_of_its_parts(text: str, metres: float) -> None:
    assert LENGTH.parse(text) == pytest.approx(metres, rel=1e-11)


def test_the_units_are_those_of_the_field() -> None:
    assert ANGLE.parse("90/2") == pytest.approx(0.785398163397, rel=1e-11)
    assert DEGREES.parse("-0.5 rad") == pytest.approx(-28.64788975654, rel=1e-11)
    assert DEGREES.parse("90 - 100 mrad") == pytest.approx(84.27042204869, rel=1e-11)
    assert (DEGREES.parse("45°"), DEGREES.parse("45"), DEGREES.format(-12.5)) == (45.0, 45.0, "-12.5")
    assert Unit("px", "px").parse("10 px + 5") == 15.0
    assert Unit("", "").parse("3*7") == 21.0
    assert Unit("W/sr", "W/sr").parse("5 W/sr") == 5.0


@pytest.mark.parametrize(
    "text",
    [
        "1+",
        "2 3",
        "1 mm * 2 mm",
        "4 / 2 mm",
        "1/0",
        "(1",
        "1)",
        "1 s + 2",
        "()",
        "__import__",
        "1**2",
        "9e999-1",
        "1e306 m",
        "1e306 m + 1",
        "(" * 99,
        "1+" * 200 + "1",
        "2*--1",
    ],
)
def test_what_has_no_value_of_this_kind_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        LENGTH.parse(text)
