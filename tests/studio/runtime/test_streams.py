"""What is printed is text, whatever the names hold; with --json it is one JSON object, whatever the values are."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.runtime.console import print_table
from studio.runtime.streams import clean, print_json, streams

ROOT = Path(__file__).resolve().parents[3]


def process(code: str, **environment: str) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, env={**os.environ, **environment}
    )


@given(st.text(st.characters(exclude_categories=())))
def test_cleaned_text_holds_no_control_character_and_can_be_encoded(text: str) -> None:
    shown = clean(text)
    shown.encode("utf-8")
    assert all(character in "\n\t" or character.isprintable() or ord(character) > 0x9F for character in shown)
    assert not set(shown) & set("\u202e\u2066\u2028\ufeff")


def test_what_is_text_already_stays_as_it_is() -> None:
    text = "Schweißnaht \u03bcm \u2026 [1, 2]\tone\ntwo\\n"
    assert clean(text) == text


@pytest.mark.parametrize(
    "name", ["[/red]", "[bold]", "[link=file:///]x[/link]", ":smile:", "\x1b[31m", "a\x9b2Jb", "\udcff"]
)
def test_names_in_tables_are_shown_as_they_are(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with streams(as_json=False):
        print_table(f"title {name}", [(name, "1")], header=(f"head {name}", "value"))
    shown = capsys.readouterr().out
    assert shown.count(clean(name)) == 3
    assert "\x1b" not in shown and "\x9b" not in shown


def test_numbers_are_not_cut_where_a_terminal_is_narrow(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studio.runtime.console.PLAIN_WIDTH", 40)
    print_table("", [("a name that needs all of the line to itself", "1234.5 um", "99.9 %")], header=("a", "b", "c"))
    shown = capsys.readouterr().out
    assert "1234.5 um" in shown and "99.9 %" in shown


def test_json_holds_null_for_what_is_not_finite(capsys: pytest.CaptureFixture[str]) -> None:
    print_json(
        {
            "nan": math.nan,
            "deep": [{"list": (1.5, -math.inf)}],
            "numpy": np.float32(np.inf),
            "array": np.array([[1.0, np.nan]]),
            "count": np.int64(3),
            "true": np.bool_(True),
            "path": Path("a\udcff"),
            "half \ud800": None,
            3: "three",
        }
    )
    text = capsys.readouterr().out
    found = json.loads(text, parse_constant=pytest.fail)
    assert found == {
        "nan": None,
        "deep": [{"list": [1.5, None]}],
        "numpy": None,
        "array": [[1.0, None]],
        "count": 3,
        "true": True,
        "path": "a\\udcff",
        "half \\ud800": None,
        "3": "three",
    }
    assert "\\ud800" not in text.replace("\\\\ud800", "")


WORDS = "import os, ctypes; os.system('echo shell'); ctypes.CDLL(None).puts(b'library'); print('python'); "


@pytest.mark.skipif(os.name == "nt", reason="descriptors of POSIX")
def test_words_of_libraries_do_not_reach_standard_output() -> None:
    work = f"from studio.runtime.streams import *\nwith streams({{}}):\n    {WORDS}print_json({{{{'ok': True}}}})"
    done = process(work.format(True))
    assert json.loads(done.stdout) == {"ok": True}
    assert all(word in done.stderr for word in (b"library", b"shell", b"python"))
    plain = process(work.format(False))
    assert plain.stdout.startswith(b"python\n{") and b"library" in plain.stderr


def test_there_is_one_json_object_and_no_second() -> None:
    done = process(
        "from studio.runtime.streams import *\nwith streams(True):\n    print_json({'n': 1}); print_json({'n': 2})"
    )
    assert json.loads(done.stdout) == {"n": 1}


@pytest.mark.parametrize("encoding", ["ascii:strict", "utf-8:strict", "latin-1:strict"])
def test_a_name_that_no_encoding_has_is_printed_as_an_escape(encoding: str) -> None:
    code = "from studio.runtime.streams import *\nwith streams(False):\n    print('a\\udcff\\u03bc')"
    done = process(code, PYTHONIOENCODING=encoding)
    assert done.returncode == 0 and b"a\\udcff" in done.stdout
