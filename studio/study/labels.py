"""What a study found as people read it: fields by their names in the inspector, their values in its units."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

from studio.editing.forms import FieldSpec
from studio.project.project import Project
from studio.study.answers import Answer, Broken
from studio.study.draft import spec_of
from studio.study.study import Parameter, Value

Labels = dict[str, str]
"""By the path of a field: "Power (mW)"."""


def as_read(answer: Answer, bases: Collection[Project]) -> tuple[Answer, Labels]:
    """The answer with its fields' values in the units of the inspector, and the labels with these units.

    What the study labels itself, and what no project has, stays in the unit of the project file.
    """
    specs = [_spec(one, bases) for one in answer.sweep.vary]
    factors = [1.0 if spec is None else spec.unit.factor for spec in specs]

    def point(values: tuple[Value, ...]) -> tuple[Value, ...]:
        return tuple(_scaled(value, factor) for value, factor in zip(values, factors, strict=True))

    vary = tuple(_in_unit(one, factor) for one, factor in zip(answer.sweep.vary, factors, strict=True))
    shown = replace(
        answer,
        sweep=answer.sweep.model_copy(update={"vary": vary}),
        spots=tuple(replace(one, point=point(one.point)) for one in answer.spots),
        broken=tuple(_broken(one, factors[0]) for one in answer.broken),
        bounds=tuple(replace(one, point=point(one.point)) for one in answer.bounds),
        kept=tuple(replace(one, point=point(one.point)) for one in answer.kept),
        beside=tuple((one.model_copy(update={"point": point(one.point)}), ours) for one, ours in answer.beside),
    )
    pairs = zip(answer.sweep.vary, specs, strict=True)
    return shown, {one.field: one.field if spec is None else _label(spec) for one, spec in pairs}


def value_text(parameter: Parameter, value: Value, bases: Collection[Project]) -> str:
    """A value of a field with its unit: "0.9 ms"."""
    from studio.study.charts import shown  # draws, which takes a while to import

    found = next((spec for base in bases if (spec := spec_of(base, parameter.field)) is not None), None)
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return found.unit.with_unit(float(value)) if found is not None and number else shown(value)  # type: ignore[arg-type]


def _spec(parameter: Parameter, bases: Collection[Project]) -> FieldSpec | None:
    """Of the first project that has the field; None: it has a label of its own, or no project has it."""
    if parameter.label:
        return None
    return next((spec for base in bases if (spec := spec_of(base, parameter.field)) is not None), None)


def _label(spec: FieldSpec) -> str:
    return f"{spec.label} ({spec.unit.shown})" if spec.unit.shown else spec.label


def _in_unit(parameter: Parameter, factor: float) -> Parameter:
    ends = {name: _scaled(getattr(parameter, name), factor) for name in ("low", "high")}
    values = tuple(_scaled(value, factor) for value in parameter.values)
    return parameter.model_copy(update={**ends, "values": values})


def _scaled(value: Value | None, factor: float) -> Value | None:
    if factor == 1.0 or isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(f"{value * factor:.12g}")


def _broken(found: Broken, factor: float) -> Broken:
    one = found.breakdown
    values = ("value", "low", "high", "last_good", "first_bad")
    return replace(found, breakdown=replace(one, **{name: factor * getattr(one, name) for name in values}))


def number_text(value: float, digits: int = 4) -> str:
    """ "-" for none."""
    return f"{value:.{digits}g}" if math.isfinite(value) else "-"


def interval_text(low: float, high: float, digits: int = 4) -> str:
    """ "-" where nothing is known, as of a single repeat."""
    known = math.isfinite(low) or math.isfinite(high)
    return f"{number_text(low, digits)} to {number_text(high, digits)}" if known else "-"
