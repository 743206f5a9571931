"""Which of many texts a person means by a few letters: every word that was typed begins a word of the text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import SequenceMatcher

FILLERS = {"a", "an", "the", "of", "to", "my"}
"""Words that say nothing beside others."""
ALIKE = 0.75
"""Share of letters from which a word may be another, typed wrongly."""
MOST = 8


def found(typed: str, texts: Sequence[tuple[str, str]]) -> list[int]:
    """Indices of the texts that fit, the best first: (name, more that tells of it) each; without a word typed, all.

    A name that begins with what was typed comes before one that has it further on, and that before what is only told.
    """
    words = _told(typed)
    ranked = []
    for i, (name, more) in enumerate(texts):
        in_name, in_all = _words(name), _words(f"{name} {more}")
        if all(any(one.startswith(word) for one in in_all) for word in words):
            alone = all(any(one.startswith(word) for one in in_name) for word in words)
            first = bool(words) and bool(in_name) and in_name[0].startswith(words[0])
            ranked.append((not (alone and first), not alone, i))
    return [i for _, _, i in sorted(ranked)]


def nearest(typed: str, texts: Sequence[tuple[str, str]]) -> list[int]:
    """Indices of the few texts that fit best where none has all words: at least half of them, also typed wrongly."""
    words, ranked = _told(typed), []
    for i, (name, more) in enumerate(texts):
        in_all = set(_words(f"{name} {more}"))
        fit = sum(max((_likeness(word, one) for one in in_all), default=0.0) for word in words)
        if words and fit >= 0.5 * len(words):
            ranked.append((-fit, len(in_all), i))
    return [i for _, _, i in sorted(ranked)[:MOST]]


def _likeness(word: str, other: str) -> float:
    """Of a typed word to the beginning of another; 0: it is another word."""
    if other.startswith(word):
        return 1.0
    if len(word) < 4:  # of so few letters half are alike by chance
        return 0.0
    alike = SequenceMatcher(None, word, other[: len(word) + 1]).ratio()
    return alike if alike >= ALIKE else 0.0


def _told(typed: str) -> list[str]:
    """The typed words that say something."""
    words = _words(typed)
    return [word for word in words if word not in FILLERS] or words


def _words(text: str) -> list[str]:
    return re.findall(r"[\w+-]+", text.casefold())
