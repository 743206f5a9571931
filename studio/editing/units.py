"""What people read and type: millimetres, degrees, milliwatts and their like, and the SI values that are stored."""

from __future__ import annotations

import contextlib
import math
import re
from dataclasses import dataclass

from analysis.report.units import grouped
from render.base.errors import InputError
from studio.editing.arithmetic import evaluate

FACTORS = {
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "in": 0.0254},
    "m2": {"mm²": 1e-6, "mm2": 1e-6, "cm2": 1e-4, "m2": 1.0},
    "rad": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180},
    "deg": {"deg": 1.0, "°": 1.0, "rad": 180 / math.pi, "mrad": 0.18 / math.pi},
    "W": {"W": 1.0, "mW": 1e-3, "uW": 1e-6, "µW": 1e-6},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6},
}
"""Units that may be typed, by the one that is stored: the SI unit, but for angles of a pose in degrees."""
SHOWN = {"m": "mm", "m2": "mm²", "rad": "deg", "W": "mW", "s": "ms"}
LENGTHS = ("mm", "um", "cm", "m", "in")
"""Units that lengths may be shown in."""


def show_lengths_in(unit: str) -> None:
    """In forms that are made from now on. ValueError: it is none of LENGTHS."""
    if unit not in LENGTHS:
        raise ValueError(f"{unit}; allowed: {', '.join(LENGTHS)}")
    SHOWN["m"] = "µm" if unit == "um" else unit


_NUMBER = re.compile(r"\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_THIN = re.compile(r"(?<=\d)[\u2009\u202f](?=\d{3})")
"""Between thousands, of a number that was copied from where it is told."""
_OPERATION = re.compile(r"[-+*(]|/\s*[\d.,(]")
"""A unit may hold a slash as well, before a letter."""


@dataclass(frozen=True)
class Unit:
    """stored: the SI unit ("m", "W/sr", ""); shown: the unit on the screen; factor: shown value over stored value."""

    stored: str = ""
    shown: str = ""
    factor: float = 1.0

    @classmethod
    def of(cls, stored: str, shown: str = "") -> Unit:
        """The unit that a stored one is shown in, the usual one unless given."""
        shown = shown or SHOWN.get(stored, stored)
        return cls(stored, shown, 1.0 / FACTORS[stored][shown] if stored in FACTORS else 1.0)

    @classmethod
    def named(cls, shown: str) -> Unit:
        """The unit that is written like this: "mm", "µm", "°", "px"."""
        stored = next((stored for stored, units in FACTORS.items() if shown in units), shown)
        return cls.of(stored, shown)

    def format(self, value: float) -> str:
        """A stored value as shown, without the unit: no needless digits, no exponent where a person can do without."""
        measured = self.stored in FACTORS or self.shown in ("deg", "mm")
        shown = value * self.factor
        # lengths and angles come out of matrices: what is left of a zero there is a zero
        return "0" if measured and abs(shown) < 1e-6 else plain(shown, 4 if measured else 6)

    def with_unit(self, value: float) -> str:
        """As a person is told it, thousands set apart."""
        return f"{_grouped(self.format(value))} {self.shown}".rstrip()

    def parse(self, text: str) -> float:
        """The stored value of what was typed: "12", "0.4 m", "1,5", "150+25". InputError: no number, no such unit."""
        text = _THIN.sub("", text)
        match = _NUMBER.fullmatch(text)
        if match is None or _OPERATION.search(match[2]):
            units = {self.shown: 1.0 / self.factor, **FACTORS.get(self.stored, {})}
            with contextlib.suppress(ValueError):
                found = evaluate(text, units, 1.0 / self.factor)
                if math.isfinite(found * self.factor):
                    return float(f"{found:.12g}")
        if match is None:
            what = "a number is missing" if not text.strip() else "this is not a number"
            raise InputError(what, allowed=f"a number in {self.shown}" if self.shown else "a number")
        value, unit = float(match[1].replace(",", ".")), match[2]
        known = FACTORS.get(self.stored, {})
        if unit and unit != self.shown and unit not in known:
            allowed = ", ".join(name for name in known if name.isascii()) or self.shown or "no unit"
            raise InputError("this unit does not fit here", found=unit, allowed=allowed)
        stored = value * known[unit] if unit in known else value / self.factor
        if not (math.isfinite(stored) and math.isfinite(stored * self.factor)):
            raise InputError("the number is too large", found=text.strip())
        return stored


DEGREES = Unit("deg", "deg", 1.0)
"""Of the rotation of a pose, which is kept and shown in them."""


def _grouped(text: str) -> str:
    whole, point, rest = text.partition(".")
    return f"{grouped(int(whole))}{point}{rest}" if whole.lstrip("-").isdigit() and whole != "-0" else text


def plain(value: float, decimals: int) -> str:
    """Up to `decimals` digits after the point, more for small numbers, at most about nine in all."""
    if abs(value) < 1e-12:
        return "0"
    if abs(value) >= 1e9 or abs(value) < 1e-6:
        return f"{value:.4g}"
    digits = decimals if abs(value) >= 10.0 ** (2 - decimals) else decimals - math.floor(math.log10(abs(value))) - 1
    digits = min(digits, max(0, 8 - math.floor(math.log10(abs(value)))))
    text = f"{value:.{digits}f}"
    text = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if text == "-0" else text
