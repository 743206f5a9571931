"""Two columns of about one height, split where tables are made.

CSS can balance columns, but a page maker lays all of them out some hundred times for it: nine tenths of the PDF's time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TypeVar

T = TypeVar("T")

LABEL, VALUE, SENTENCE = 22, 38, 62
"""Letters on a line of a table's label and value, and of a sentence as wide as a column."""
TITLE, ROW = 2.5, 1.25
"""Lines that a title and a row of a table take, with the space around them."""
PAGE = 52.0
"""Lines of a column of the PDF, so that a block of two never needs to be broken."""


def columns(items: Sequence[T], heights: Iterable[float]) -> list[tuple[Sequence[T], Sequence[T]]]:
    """The items in their order as blocks of two columns, left and right, each block at most a page high.

    heights: lines of each item; one that is higher than a page has a block of its own.
    """
    found, start, sizes = [], 0, list(heights)
    while start < len(items):
        stop = start + 1
        while stop < len(items) and _split(sizes[start : stop + 1])[0] <= PAGE:
            stop += 1
        middle = start + _split(sizes[start:stop])[1]
        found.append((items[start:middle], items[middle:stop]))
        start = stop
    return found


def _split(heights: Sequence[float]) -> tuple[float, int]:
    """The height of two columns of these items, as low as it can be, and how many of them are left."""
    return min((max(sum(heights[:i]), sum(heights[i:])), i) for i in range(1, len(heights) + 1))


def table_height(rows: Iterable[tuple[str, str]]) -> float:
    """Lines of a titled table of labels and values, about."""
    lines = (max(math.ceil(len(label) / LABEL), math.ceil(len(value) / VALUE), 1) for label, value in rows)
    return TITLE + ROW * sum(lines)


def sentence_height(title: str, text: str) -> float:
    """Lines of a sentence below its title, about."""
    return TITLE + math.ceil(len(text) / SENTENCE)
