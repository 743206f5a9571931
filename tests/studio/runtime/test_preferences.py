"""Preferences are never a reason not to start, and damaged ones are not lost."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from studio.runtime.preferences import Preferences, PreferencesFile

DAMAGED = {
    "empty": b"",
    "cut": b'{"theme": "da',
    "a list": b"[]",
    "nested": b"[" * 100_000,
    "nested and closed": b'{"recent": ' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    "half a character": b'{"recent": ["\\ud800.json"]}',
    "not UTF-8": b'{"recent": ["\xff.json"]}',
    "a theme that is none": b'{"theme": "purple"}',
    "numbers for names": b'{"recent": [1, 2]}',
    "a digit too many": b'{"toured": 1' + b"0" * 5000 + b"}",
    "too long a list": json.dumps({"recent": ["a.json"] * 100_000}).encode(),
    "megabytes": b" " * (2**20 + 1),
}


@pytest.mark.parametrize("data", DAMAGED.values(), ids=DAMAGED.keys())
def test_a_damaged_file_is_put_aside_with_a_word(data: bytes, tmp_path: Path) -> None:
    (tmp_path / "preferences.json").write_bytes(data)
    preferences = PreferencesFile(tmp_path)
    assert preferences.values == Preferences()
    assert "start anew" in preferences.trouble and "preferences.damaged.json" in preferences.trouble
    assert (tmp_path / "preferences.damaged.json").read_bytes() == data
    preferences.change(theme="dark")
    again = PreferencesFile(tmp_path)
    assert again.values.theme == "dark" and again.trouble == ""


@pytest.mark.skipif(os.name == "nt", reason="pipes of POSIX")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "preferences.json")
    assert "not a regular file" in PreferencesFile(tmp_path).trouble


def test_where_nothing_can_be_put_aside_the_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "preferences.json").mkdir()
    (tmp_path / "preferences.damaged.json").mkdir()
    (tmp_path / "preferences.damaged.json" / "kept").touch()
    preferences = PreferencesFile(tmp_path)
    assert str(tmp_path / "preferences.json") in preferences.trouble
    preferences.change(theme="dark")
    assert preferences.values.theme == "dark"


def test_the_first_start_is_no_damage(tmp_path: Path) -> None:
    assert PreferencesFile(tmp_path / "none").trouble == ""
    (tmp_path / "file").touch()
    assert PreferencesFile(tmp_path / "file").trouble == ""


def test_a_name_that_is_not_text_is_not_remembered_and_nothing_else_is_forgotten(tmp_path: Path) -> None:
    preferences = PreferencesFile(tmp_path)
    preferences.add_recent(tmp_path / "a.json")
    before = preferences.values
    preferences.add_recent(tmp_path / os.fsdecode(b"\xff.json"))
    preferences.change(folder=os.fsdecode(b"/\xff"))
    assert preferences.values == before == PreferencesFile(tmp_path).values
    with pytest.raises(ValueError, match="theme"):
        preferences.change(theme="purple")
