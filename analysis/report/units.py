"""Numbers as people read them: um, mm, deg, mW, ms, with a no-break space. The only place where SI is left behind."""

from __future__ import annotations

import math

NONE = "–"  # noqa: RUF001 - a dash in a table
MOST_OF_ALL = 99.9
"""%, in three digits."""


def digits(value: float, significant: int = 3) -> str:
    """A number with so many significant digits, no exponent between 1e-4 and 1e6."""
    if not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if not -5 < size < 6:
        return f"{value:.{significant - 1}e}"
    return f"{value:.{max(0, significant - 1 - size)}f}"


def digits_of_percent(value: float) -> str:
    """Three significant digits of a share in %; one that is not all of it is never rounded up to 100."""
    return digits(min(value, MOST_OF_ALL) if value < 100.0 else value)


def micrometres(value: float, significant: int = 3) -> str:
    """m -> "21.7 µm", or mm from 10 mm on."""
    if not math.isfinite(value):
        return NONE
    return (
        f"{digits(value * 1e3, significant)}\u00a0mm"
        if abs(value) >= 0.01
        else f"{digits(value * 1e6, significant)}\u00a0µm"
    )


def millimetres(value: float, significant: int = 4) -> str:
    """m -> "866 mm"."""
    return f"{digits(value * 1e3, significant)}\u00a0mm" if math.isfinite(value) else NONE


def pixels(value: float, significant: int = 3) -> str:
    """px -> "0.0252 px"."""
    return f"{digits(value, significant)}\u00a0px" if math.isfinite(value) else NONE


def degrees(value: float, significant: int = 4) -> str:
    """rad -> "45°"."""
    return f"{math.degrees(value):.{significant}g}°" if math.isfinite(value) else NONE


def milliwatts(value: float) -> str:
    """W -> "20 mW"."""
    return f"{value * 1e3:.4g}\u00a0mW"


def milliseconds(value: float) -> str:
    """s -> "3.8 ms"."""
    return f"{value * 1e3:.4g}\u00a0ms"


def seconds(value: float) -> str:
    """s -> "0.07 s", "12.3 s", "3 min 4 s"."""
    if value >= 120:
        return f"{int(value // 60)} min {value % 60:.0f}\u00a0s"
    return f"{value:.2f}\u00a0s" if value < 10 else f"{value:.1f}\u00a0s"


def percent(value: float, decimals: int = 1) -> str:
    """Fraction -> "98.2 %"; what is not all of it is never rounded up to 100, nor some, of a million, to 0."""
    if not math.isfinite(value):
        return NONE
    while 0.0 < 100.0 * value < 0.5 * 10.0**-decimals and decimals < 4:
        decimals += 1
    shown = min(100.0 * value, 100.0 - 10.0**-decimals) if value < 1.0 else 100.0 * value
    return f"{shown:.{decimals}f}\u00a0%"


def grouped(value: float, decimals: int = 0) -> str:
    """Thousands set apart by thin spaces that no line breaks at, as a comma may be a decimal one: "1 820.5"."""
    return f"{value:,.{decimals}f}".replace(",", "\u202f")


def count(value: float) -> str:
    """ "1 820"; from 10 million on "191 million"."""
    return f"{grouped(value / 1e6)}\u00a0million" if value >= 1e7 else grouped(value)


def counted(number: float, noun: str) -> str:
    """ "1 line", "1 820 lines"."""
    return f"{count(number)} {noun}{'' if number == 1 else 's'}"
