"""A few letters of each word find what is meant, the likeliest first."""

from __future__ import annotations

import pytest

from studio.runtime.word_search import found, nearest

TEXTS = (
    ("Open…", "File: a project file"),
    ("Report as PDF…", "File Export: to print"),
    ("Run the whole scan…", "Render: points and report"),
    ("Add", "Scene"),
    ("Études", "Render"),
    ("+z is up", "Scene"),
)


@pytest.mark.parametrize(
    ("typed", "expected"),
    [
        ("report", [1, 2]),
        ("REP pd", [1]),
        ("pdf report", [1]),
        ("sc", [2, 3, 5]),
        ("run a scan", [2]),
        ("the", [2]),
        ("port", []),
        ("étu", [4]),
        ("+z", [5]),
        ("", [0, 1, 2, 3, 4, 5]),
        (" ...  ", [0, 1, 2, 3, 4, 5]),
        ("( [ \\", [0, 1, 2, 3, 4, 5]),
    ],
)
def test_words_are_found_by_how_they_begin_in_any_order(typed: str, expected: list[int]) -> None:
    assert found(typed, TEXTS) == expected


def test_a_name_comes_before_a_place_and_its_beginning_before_its_middle() -> None:
    texts = [("Close", "Scan"), ("Run the scan", ""), ("Scan again", "")]
    assert found("scan", texts) == [2, 1, 0]


@pytest.mark.parametrize(
    ("typed", "expected"),
    [("raport", [1, 2]), ("print a letter", [1]), ("reprot pdf", [1]), ("xyz", []), ("nothing of this", []), ("", [])],
)
def test_where_none_has_all_words_the_nearest_have_most_of_them(typed: str, expected: list[int]) -> None:
    assert nearest(typed, TEXTS) == expected
