"""Tables as CSV: what is not known is an empty cell, and every line ends in a line feed."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from render.base.csv_file import write_csv
from render.base.errors import InputError


def test_what_is_not_known_is_empty_and_text_comes_back_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    said = 'a "quoted", cell\nof two lines'
    write_csv(path, ("what", "value"), [(said, 0.1), ("none", None), ("nan", float("nan")), ("zero", 0)])
    assert b"\r" not in path.read_bytes()
    with open(path, newline="", encoding="utf-8") as file:
        assert list(csv.reader(file)) == [["what", "value"], [said, "0.1"], ["none", ""], ["nan", ""], ["zero", "0"]]


def test_a_row_that_fails_leaves_the_table_that_was_there(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_csv(path, ("a",), [(1,)])

    def rows() -> object:
        yield (2,)
        raise InputError("nothing more is known")

    with pytest.raises(InputError):
        write_csv(path, ("a",), rows())  # type: ignore[arg-type]
    assert path.read_text() == "a\n1\n" and [one.name for one in tmp_path.iterdir()] == ["table.csv"]
