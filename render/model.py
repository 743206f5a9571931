"""Base of every scene model: frozen, validated, and self-describing for forms and messages."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

Vector3 = tuple[float, float, float]
UnitInterval = Annotated[float, Field(ge=0.0, le=1.0)]


class Model(BaseModel):
    """Frozen; unknown keys, infinities and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, ser_json_inf_nan="constants")


def quantity(default: Any = ..., *, unit: str = "", label: str = "", help: str = "", **limits: Any) -> Any:
    """A pydantic field that also carries what a form shows: label, SI unit ("m", "rad", "W", "s", "nm", "") and help."""
    return Field(default, title=label or None, description=help or None, json_schema_extra={"unit": unit}, **limits)
