"""Whom a report is handed to, what it is of, and by which tolerance: its first pages are made of this."""

from __future__ import annotations

from typing import Self

from pydantic import model_validator

from render.base.model import Model, quantity

LONG = 120


class Delivery(Model):
    """Empty: the report has no pages for a customer."""

    customer: str = quantity("", label="Customer", help="To whom the report is handed.", max_length=LONG)
    author: str = quantity("", label="Author", help="Who answers for it.", max_length=LONG)
    part: str = quantity("", label="Part", max_length=LONG)
    part_number: str = quantity("", label="Part number", max_length=LONG)
    order_number: str = quantity("", label="Order number", max_length=LONG)
    text: str = quantity("", label="Text", help="What else the customer is to read.", max_length=4000)
    logo: str = quantity(
        "", label="Logo", help="An image in the project's folder, PNG or JPEG: its path from there.", max_length=1000
    )
    lower: float | None = quantity(
        None,
        unit="m",
        label="Surface tolerance from",
        help="Lower limit of the surface's deviation. Missing material has a minus sign: -50 µm allows 50 µm too "
        "little. Empty: there is no lower limit.",
        ge=-1.0,
        le=1.0,
    )
    upper: float | None = quantity(
        None,
        unit="m",
        label="Surface tolerance to",
        help="Upper limit of the surface's deviation: 50 µm allows 50 µm too much material. Empty: there is no upper "
        "limit.",
        ge=-1.0,
        le=1.0,
    )
    surface_of: str = quantity(
        "",
        label="Surface tolerance of",
        help="The object whose surface the tolerance is of; empty: all of them.",
        max_length=LONG,
    )

    @model_validator(mode="after")
    def _tolerance_is_one(self) -> Self:
        if self.lower is not None and self.upper is not None and not self.upper > self.lower:
            found = f"lower is {1e3 * self.lower:.6g} mm and upper {1e3 * self.upper:.6g} mm"
            raise ValueError(f"{found}; allowed: upper is above lower")
        return self

    @property
    def is_empty(self) -> bool:
        """Nothing is said: the report is for whoever made it."""
        return self == Delivery()

    @property
    def has_tolerance(self) -> bool:
        """Of the surface, with one limit or two."""
        return self.lower is not None or self.upper is not None
