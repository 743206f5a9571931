"""Numbers are read as what they are: some is not none, and not all is not all."""

from __future__ import annotations

import pytest

from analysis.report.units import digits_of_percent, percent


@pytest.mark.parametrize(
    ("share", "told"),
    [
        (1.0, "100.0 %"),
        (0.9996, "99.9 %"),
        (0.5, "50.0 %"),
        (0.0, "0.0 %"),
        (1 / 2049, "0.05 %"),
        (3e-5, "0.003 %"),
        (1e-9, "0.0000 %"),
        (float("nan"), "–"),  # noqa: RUF001 - a dash in a table
    ],
)
def test_a_share_is_neither_rounded_to_none_nor_to_all(share: float, told: str) -> None:
    assert percent(share).replace("\u00a0", " ") == told


def test_three_digits_of_not_all_are_not_all() -> None:
    """One of 2,043 scan lines was missing from "100.0", and from "99.9" beside it."""
    assert [digits_of_percent(value) for value in (99.951, 99.999, 100.0, 12.34)] == ["99.9", "99.9", "100", "12.3"]
