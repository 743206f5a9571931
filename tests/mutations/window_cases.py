"""What a person brings to the window alone: STEP files to import, and expressions typed into a field."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

from studio.editing.units import FACTORS
from tests.mutations.damage import damaged
from tests.mutations.option_cases import NUMBERS, WORDS
from tests.mutations.sources import Sources
from tests.studio.project.step_text import pin

SIGNS = (
    "+", "-", "*", "/", "(", ")", "--", "**", "//", "^", "=", ",", ".", "°", "²", "\u00d7", "\u2212", "e",
    "\u0663", "\u2028",
)  # fmt: skip
UNITS = ("mm", "m", "in", "um", "µm", "deg", "rad", "mrad", "s", "ms", "W", "mW", "px", "Mm", "MM", "inch")
LENGTHS = (
    "0.",
    "-1.",
    "1.E-9",
    "1.E9",
    "1.E300",
    "NAN",
    "1.E999",
    "$",
    "*",
    "''",
    "#1",
    "#99999",
    "(1.,2.)",
    "9" * 400,
)


def step(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    """A pin with a fault in its bytes, or with a reference or a number that means something else."""
    text = pin(5.0, 20.0, rng.choice(("mm", "m")) if harm else "mm")
    content = text.encode()
    if harm and rng.random() < 0.6:
        references = rng.random() < 0.5
        found = list(re.finditer(r"#\d+(?!=)\b" if references else r"\d+\.\d*", text))
        for one in rng.sample(found, rng.choice((1, 1, 2, 5))):
            other = f"#{rng.randrange(1, 100)}" if references else rng.choice(LENGTHS)
            text = text[: one.start()] + other.ljust(len(one[0])) + text[one.end() :]
        content = text.encode()
    elif harm:
        content = damaged(content, rng)
    name = rng.choice(("part.step", "part.stp", "part.STEP", "a b.step", "é.stp")) if harm else "part.step"
    (place / name).write_bytes(content)
    return ["import", name]


def expression(sources: Sources, place: Path, rng: Random, harm: bool) -> list[str]:
    """Numbers, units, signs and brackets in an order that means something, or does not."""
    unit = rng.choice((*FACTORS, "")) if harm else "m"
    if not harm:
        return ["expression", unit, "2*(150 mm + 1 in) - 1/3"]
    ways = ((NUMBERS, 5), (SIGNS, 5), (UNITS, 3), (WORDS, 0.3), ((" ",), 1))
    kinds, weights = zip(*ways, strict=True)
    parts = [rng.choice(rng.choices(kinds, weights)[0]) for _ in range(rng.choice((1, 2, 3, 5, 9, 40)))]
    text = "".join(parts)
    if rng.random() < 0.2:
        text = "(" * rng.choice((1, 19, 20, 500)) + text + ")" * rng.choice((1, 19, 20, 500))
    return ["expression", unit, text.replace("\0", "")]
