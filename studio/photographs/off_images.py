"""Which laser-off image belongs to which photograph: one for all, or one each, by name or in order."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from render.base.errors import InputError

WORDS = re.compile(r"(?<![a-z])(on|off|laser|dark|ambient|background)(?![a-z])")
"""What tells the two of a pair apart: left out before names are compared."""


def pair_offs(images: Sequence[Path], offs: Sequence[Path]) -> tuple[tuple[Path | None, ...], str]:
    """Laser-off image of each image, and how it was found, for a person. InputError: they do not go together."""
    if not offs:
        return (None,) * len(images), ""
    if len(offs) == 1:
        return tuple(offs) * len(images), f"{offs[0].name}, one for all"
    keys = [_key(path) for path in offs]
    by_name = dict(zip(keys, offs, strict=True))
    named = [by_name.get(_key(path)) for path in images]
    if len(by_name) == len(offs) and all(named):
        return tuple(named), "one for each, by name"
    if len(offs) == len(images):
        return tuple(offs), "one for each, in order"
    raise InputError(
        "the laser-off images do not go with the images",
        where="--off",
        found=f"{len(offs)} for {len(images)} images",
        allowed="one for all; one for each, in order; or one of the same name for each, such as a_off.png for a.png",
    )


def _key(path: Path) -> str:
    return re.sub(r"[^a-z0-9]+", "", WORDS.sub("", path.stem.lower().replace("_", " ")))
