"""Thousands are set apart by thin spaces wherever a number is told, and such a number can be typed."""

from __future__ import annotations

import pytest

from render.laser.laser import LineLaser
from studio.editing.forms import describe
from studio.editing.units import Unit

THIN = "\u202f"


@pytest.mark.parametrize(
    ("unit", "value", "told"),
    [
        ("W", 1e4, f"10{THIN}000{THIN}000 mW"),
        ("m", 1.131, f"1{THIN}131 mm"),
        ("m", -1.5004, f"-1{THIN}500.4 mm"),
        ("m", 0.999, "999 mm"),
        ("", 1e12, "1e+12"),
        ("", -1e-9, "-1e-09"),
    ],
)
def test_they_are_told_apart_and_read_as_they_are_told(unit: str, value: float, told: str) -> None:
    assert Unit.of(unit).with_unit(value) == told
    assert Unit.of(unit).parse(told) == pytest.approx(value, rel=1e-12)


def test_a_limit_is_told_so_too() -> None:
    """10000000 mW, beside 2,611 e- and 2 048 lines."""
    power = next(spec for spec in describe(LineLaser()) if spec.name == "power")
    assert power.problem(2e4) == f"must be at most 10{THIN}000{THIN}000 mW"


def test_a_field_holds_what_can_be_typed_on_any_keyboard() -> None:
    assert Unit.of("m").format(1.5) == "1500"
