"""A crash in native code leaves a file that the next start reads, once."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from studio.runtime.fault_log import FILE, PUT_AWAY, last_fault

ROOT = Path(__file__).resolve().parents[3]
CRASH = """
import ctypes, sys
from pathlib import Path
from studio.runtime.fault_log import watch

watch(Path(sys.argv[1]))
def the_culprit():
    if sys.argv[2] == "crash":
        ctypes.string_at(0)
the_culprit()
"""


def run(folder: Path, how: str) -> int:
    done = subprocess.run([sys.executable, "-c", CRASH, str(folder), how], cwd=ROOT, capture_output=True, timeout=120)
    return done.returncode


def test_a_crash_is_told_once_with_the_place_and_put_away(tmp_path: Path) -> None:
    folder = tmp_path / "state"
    assert last_fault(folder) is None
    assert run(folder, "crash") != 0
    fault = last_fault(folder)
    assert fault is not None
    assert "egmentation fault" in fault.text or "access violation" in fault.text
    assert "the_culprit" in fault.text and fault.when.startswith("2")
    assert (folder / PUT_AWAY).read_text(encoding="utf-8") == fault.text
    assert last_fault(folder) is None


def test_an_end_in_order_leaves_nothing_to_tell(tmp_path: Path) -> None:
    assert run(tmp_path, "end") == 0
    assert last_fault(tmp_path) is None


def test_a_program_that_runs_on_can_still_tell_after_another_has_read(tmp_path: Path) -> None:
    """The file is emptied, not taken away from under it."""
    with open(tmp_path / FILE, "ab", buffering=0) as running:
        running.write(b"first")
        assert getattr(last_fault(tmp_path), "text", "") == "first"
        running.write(b"second")
        assert getattr(last_fault(tmp_path), "text", "") == "second"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_pipe_or_a_file_in_its_place_holds_up_no_start(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / FILE)
    assert run(tmp_path, "end") == 0
    assert last_fault(tmp_path) is None
    (tmp_path / "file").write_text("not a folder")
    assert run(tmp_path / "file", "end") == 0
    assert last_fault(tmp_path / "file") is None
