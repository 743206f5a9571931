"""Tables in two columns: in their order, as level as they can be, and never higher than a page."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.report.columns import PAGE, columns, sentence_height, table_height
from analysis.report.glossary import GLOSSARY


@pytest.mark.parametrize("seed", range(20))
def test_everything_is_there_once_in_its_order_and_no_block_needs_a_break(seed: int) -> None:
    rng = np.random.default_rng(seed)
    heights = rng.uniform(2.0, 30.0, rng.integers(0, 25))
    items = list(range(len(heights)))
    blocks = columns(items, heights)
    assert [item for left, right in blocks for item in (*left, *right)] == items
    for left, right in blocks:
        assert max(heights[list(left)].sum(), heights[list(right)].sum()) <= PAGE
        levels = [abs(heights[left[0] : i].sum() - heights[i : (right or left)[-1] + 1].sum()) for i in (*left, *right)]
        assert abs(heights[list(left)].sum() - heights[list(right)].sum()) <= min(levels) + 1e-9


def test_what_is_higher_than_a_page_stands_alone() -> None:
    assert columns("abc", [3.0, 2 * PAGE, 3.0]) == [("a", ""), ("b", ""), ("c", "")]


def test_a_long_value_takes_more_lines_than_a_short_one() -> None:
    assert table_height([("a", "x" * 200)]) > table_height([("a", "x"), ("b", "x")]) > table_height([("a", "x")])
    assert len(columns(GLOSSARY, [sentence_height(*entry) for entry in GLOSSARY])) == 1
