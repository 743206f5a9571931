"""What the fields of a report's delivery say of themselves."""

from __future__ import annotations

import pytest

from analysis.report.delivery import Delivery


@pytest.mark.parametrize("name", ["lower", "upper", "surface_of"])
def test_fields_of_the_surfaces_tolerance_say_that_they_are_one(name: str) -> None:
    """ "Surface from, to, of" might have been places."""
    assert (Delivery.model_fields[name].title or "").startswith("Surface tolerance")


def test_limits_of_the_surface_say_by_an_example_which_sign_missing_material_has() -> None:
    lower, upper = (Delivery.model_fields[name].description or "" for name in ("lower", "upper"))
    assert "-50 µm allows 50 µm too little" in lower and "50 µm allows 50 µm too much" in upper
