"""Base of every scene model: frozen, validated, and self-describing for forms and messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Field

Vector3 = tuple[float, float, float]
Metres = Annotated[float, Field(ge=-1e5, le=1e5)]
"""A coordinate, m: beyond this the float32 positions of Embree are coarser than a centimetre."""
Position = tuple[Metres, Metres, Metres]
UnitInterval = Annotated[float, Field(ge=0.0, le=1.0)]


class Model(BaseModel):
    """Frozen; unknown keys, infinities and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, ser_json_inf_nan="constants")

    def __eq__(self, other: object) -> bool:
        """By fields alone: cached properties hold arrays, which have no truth value."""
        if type(self) is not type(other):
            return NotImplemented
        return all(getattr(self, name) == getattr(other, name) for name in type(self).model_fields)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy without the cached properties, which belong to the old values."""
        copied = super().model_copy(update=update, deep=deep)
        for name in copied.__dict__.keys() - type(self).model_fields.keys():
            del copied.__dict__[name]
        return copied


def quantity(default: Any = ..., *, unit: str = "", label: str = "", help: str = "", **limits: Any) -> Any:
    """A pydantic field that carries what a form shows: label, SI unit ("m", "rad", "W", "s", "nm", "") and help."""
    return Field(default, title=label or None, description=help or None, json_schema_extra={"unit": unit}, **limits)
