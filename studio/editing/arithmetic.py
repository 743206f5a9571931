"""Sums and products of numbers with units, as people type them into a number's field: "150+25", "2*(1 in - 3 mm)"."""

from __future__ import annotations

import re
from collections.abc import Mapping

TOKEN = re.compile(r"\s*(?:(\d+[.,]?\d*(?:[eE][+-]?\d+)?|[.,]\d+(?:[eE][+-]?\d+)?)|([^\W\d_]+|°)|([-+*/()]))")
LONGEST, DEEPEST = 200, 20
"""Characters, and brackets within each other."""
Value = tuple[float, bool]
"""A number, and whether it has a unit, whose factor it is then multiplied by."""


def evaluate(text: str, units: Mapping[str, float], bare: float) -> float:
    """The value of an expression in the unit whose factor is 1; bare: factor of a number that is left without one.

    A factor of a product may be a plain number, and the terms of a sum without a unit have the bare one. ValueError:
    it is no expression, or multiplies or divides by something that has a unit.
    """
    return _Parser(text, units, bare).whole()


class _Parser:
    """By recursive descent over the tokens."""

    def __init__(self, text: str, units: Mapping[str, float], bare: float) -> None:
        if len(text) > LONGEST:
            raise ValueError("too long")
        self.units, self.bare, self.depth = units, bare, 0
        self.tokens: list[tuple[str, str]] = []
        at, text = 0, text.rstrip()
        while at < len(text):
            match = TOKEN.match(text, at)
            if match is None:
                raise ValueError(text[at:])
            kind = ("number", "unit", "sign")[(match.lastindex or 1) - 1]
            self.tokens.append((kind, match[match.lastindex or 1]))
            at = match.end()

    def whole(self) -> float:
        value = self._with_unit(self._sum())
        if self.tokens:
            raise ValueError(self.tokens[0][1])
        return value

    def _sum(self) -> Value:
        value = self._product()
        while sign := self._taken("+-"):
            other = self._product()
            if value[1] or other[1]:
                value, other = (self._with_unit(value), True), (self._with_unit(other), True)
            value = (value[0] + (other[0] if sign == "+" else -other[0]), value[1])
        return value

    def _product(self) -> Value:
        value = self._factor()
        while sign := self._taken("*/"):
            other = self._factor()
            if other[1] and (value[1] or sign == "/"):
                raise ValueError("units are multiplied")
            if sign == "/" and other[0] == 0.0:
                raise ValueError("division by zero")
            value = (value[0] * other[0] if sign == "*" else value[0] / other[0], value[1] or other[1])
        return value

    def _factor(self) -> Value:
        self.depth += 1
        if self.depth > DEEPEST or not self.tokens:
            raise ValueError("it ends too early")
        if sign := self._taken("+-"):
            if self._taken("+-"):
                raise ValueError("two signs")
            value = self._factor()
            value = (-value[0] if sign == "-" else value[0], value[1])
        elif self._taken("("):
            value = self._sum()
            if not self._taken(")"):
                raise ValueError("a bracket is missing")
        else:
            value = self._number()
        self.depth -= 1
        return value

    def _number(self) -> Value:
        kind, text = self.tokens.pop(0)
        if kind != "number":
            raise ValueError(text)
        value = float(text.replace(",", "."))
        if not self.tokens or self.tokens[0][0] != "unit":
            return value, False
        unit = self.tokens.pop(0)[1]
        if unit not in self.units:
            raise ValueError(unit)
        return value * self.units[unit], True

    def _with_unit(self, value: Value) -> float:
        return value[0] if value[1] else value[0] * self.bare

    def _taken(self, signs: str) -> str:
        if self.tokens and self.tokens[0][0] == "sign" and self.tokens[0][1] in signs:
            return self.tokens.pop(0)[1]
        return ""
