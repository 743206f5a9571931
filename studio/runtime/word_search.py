"""Which of many texts a person means by a few letters: every word that was typed begins a word of the text."""

from __future__ import annotations

import re
from collections.abc import Sequence


def found(typed: str, texts: Sequence[tuple[str, str]]) -> list[int]:
    """Indices of the texts that fit, the best first: (name, more that tells of it) each; without a word typed, all.

    A name that begins with what was typed comes before one that has it further on, and that before what is only told.
    """
    words = _words(typed)
    ranked = []
    for i, (name, more) in enumerate(texts):
        in_name, in_all = _words(name), _words(f"{name} {more}")
        if all(any(one.startswith(word) for one in in_all) for word in words):
            alone = all(any(one.startswith(word) for one in in_name) for word in words)
            first = bool(words) and bool(in_name) and in_name[0].startswith(words[0])
            ranked.append((not (alone and first), not alone, i))
    return [i for _, _, i in sorted(ranked)]


def _words(text: str) -> list[str]:
    return re.findall(r"[\w+-]+", text.casefold())
