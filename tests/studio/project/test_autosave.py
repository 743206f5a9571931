"""Work survives a crash: kill -9 at any moment leaves a whole project file, and an autosave that opens."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from render.base.errors import InputError
from studio.project.autosave import Autosave, find, find_of, sweep
from studio.project.date_and_time import read_out
from studio.project.document import Document
from studio.project.project import Project
from studio.project.templates import template_folder

ROOT = Path(__file__).resolve().parents[3]
needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="kills need fork")

SAVING = """
    import os, sys
    from pathlib import Path
    from studio.project.autosave import Autosave
    from studio.project.document import Document
    from studio.project.project import Project

    project = Project.load(sys.argv[1])
    target, folder = Path(sys.argv[2]), Path(sys.argv[3])
    for line in sys.stdin:  # each line asks for one more child that saves until it is killed
        first = int(line)
        child = os.fork()
        if child:
            os.write(1, f"child {child}\\n".encode())  # whole lines, two processes write them
            os.waitpid(child, 0)
            continue
        document, autosave = Document(project, target), Autosave(folder)
        number = first
        while True:
            document.set(("seed",), number)
            autosave.keep(document)
            document.save()
            document.set(("name",), f"unsaved {number}")
            autosave.keep(document)
            if number == first:
                os.write(1, f"kept {first}\\n".encode())
            number += 1
"""
"""Saves and keeps in turn, as fast as it can."""


@pytest.fixture
def document() -> Document:
    folder = template_folder("plane")
    return Document(Project.load(folder / "project.json"), None, folder)


@pytest.fixture
def saver(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A process that forks a saving child for each line it reads, and prints its number."""
    arguments = [str(template_folder("plane") / "project.json"), str(tmp_path / "project.json"), str(tmp_path / "kept")]
    command = [sys.executable, "-c", textwrap.dedent(SAVING), *arguments]
    process = subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    yield process
    assert process.stdin is not None
    process.stdin.close()
    process.wait(180)


def told(saver: subprocess.Popen[str], what: str) -> int:
    """The number in the next line that begins so."""
    assert saver.stdout is not None
    return next(int(line.split()[1]) for line in saver.stdout if line.startswith(what))


def kill_in_the_middle(saver: subprocess.Popen[str], folder: Path, times: int) -> int:
    """Kill so often, each time look at what is left; returns how many autosaves were opened."""
    assert saver.stdin is not None and saver.stdout is not None
    chance = random.Random(7)
    target, kept, opened, last = folder / "project.json", folder / "kept", 0, -1
    for round_ in range(times):
        saver.stdin.write(f"{1000 * round_}\n")
        saver.stdin.flush()
        child = told(saver, "child")
        if round_ % 5 == 0 and target.exists():
            time.sleep(chance.uniform(0.0, 0.01))  # in its first steps
        else:
            assert told(saver, "kept") == 1000 * round_
            time.sleep(chance.uniform(0.0, 0.03))
        os.kill(child, signal.SIGKILL)
        # the lock of the killed program is free once the system has cleared it away
        until = time.monotonic() + 180.0
        while (Path("/proc") / str(child) / "fd").exists() and time.monotonic() < until:
            time.sleep(0.0005)
        saved = Project.load(target)  # whole: it validates
        assert saved.seed >= last
        last = saved.seed
        sweep(kept)
        for left in find(kept):
            assert left.document().dirty
            # never older than the file: what was kept before the last save is at most one edit behind it
            assert left.project.seed >= saved.seed - 1 or left.project.name.startswith("unsaved")
            opened += 1
            left.discard()
        assert not [file for file in kept.iterdir() if file.suffix == ".json" and not file.name.startswith(".")]
    return opened


@needs_fork
def test_a_killed_program_leaves_a_whole_file_and_its_work(saver: subprocess.Popen[str], tmp_path: Path) -> None:
    # four of five kills come after the first autosave; a few of these hit between a save and the next autosave
    assert kill_in_the_middle(saver, tmp_path, 50) >= 30


@needs_fork
@pytest.mark.validation
def test_five_hundred_kills(saver: subprocess.Popen[str], tmp_path: Path) -> None:
    assert kill_in_the_middle(saver, tmp_path, 500) >= 300


def test_what_is_kept_opens_as_unsaved_work_with_its_files(document: Document, tmp_path: Path) -> None:
    document.set(("scene", "rig", "lasers", 0, "power"), 0.123)
    program = Autosave(tmp_path)
    assert program.keep(document)
    end_without_closing(program)
    (left,) = find(tmp_path)
    recovered = left.document()
    assert recovered.project == document.project and recovered.dirty
    assert recovered.root == document.root and recovered.path is None


def test_recovered_work_knows_the_file_it_came_from(document: Document, tmp_path: Path) -> None:
    document.save(tmp_path / "mine.json")
    document.set(("seed",), 77)
    program = Autosave(tmp_path / "kept")
    program.keep(document)
    end_without_closing(program)
    recovered = find(tmp_path / "kept")[0].document()
    assert recovered.path == tmp_path / "mine.json" and recovered.dirty
    assert not recovered.changed_on_disk, "nobody else has written it"
    recovered.save()
    assert Project.load(tmp_path / "mine.json").seed == 77


def test_recovered_work_knows_that_its_file_was_written_since(document: Document, tmp_path: Path) -> None:
    document.save(tmp_path / "mine.json")
    document.set(("seed",), 77)
    program = Autosave(tmp_path / "kept")
    program.keep(document)
    end_without_closing(program)
    other = Document(Project.load(tmp_path / "mine.json"), tmp_path / "mine.json")
    other.set(("seed",), 8)
    other.save()
    assert find(tmp_path / "kept")[0].document().changed_on_disk


@pytest.mark.skipif(sys.platform == "win32", reason="links need a right there")
def test_the_work_of_a_project_is_found_however_its_file_is_reached(
    document: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document.save(tmp_path / "mine.json")
    document.set(("seed",), 77)
    program = Autosave(tmp_path / "kept")
    program.keep(document)
    end_without_closing(program)
    (tmp_path / "link.json").symlink_to(tmp_path / "mine.json")
    (tmp_path / "other.json").write_text("{}")
    monkeypatch.chdir(tmp_path)
    for reached in (Path("mine.json"), tmp_path / "link.json"):
        assert [left.project.seed for left in find_of(tmp_path / "kept", reached)] == [77]
    assert find_of(tmp_path / "kept", tmp_path / "other.json") == []
    damaged = json.loads(program.file.read_text()) | {"path": "\0"}
    program.file.write_text(json.dumps(damaged))
    assert find_of(tmp_path / "kept", tmp_path / "mine.json") == []


def test_a_running_program_keeps_its_own(document: Document, tmp_path: Path) -> None:
    document.set(("seed",), 5)
    program = Autosave(tmp_path)
    program.keep(document)
    sweep(tmp_path)
    assert find(tmp_path) == []
    assert program.file.exists()
    program.close()


def test_nothing_is_left_of_an_orderly_end(document: Document, tmp_path: Path) -> None:
    program = Autosave(tmp_path)
    (program.draft() / "mesh.ply").write_text("ply")
    document.set(("seed",), 5)
    program.keep(document)
    program.close()
    assert list(tmp_path.iterdir()) == []


def test_saved_work_is_not_kept_twice(document: Document, tmp_path: Path) -> None:
    program = Autosave(tmp_path / "kept")
    document.set(("seed",), 5)
    assert program.keep(document) and not program.keep(document)
    document.save(tmp_path / "mine.json")
    assert not program.keep(document)
    assert not program.file.exists()


def test_a_draft_goes_with_the_work_that_was_thrown_away(document: Document, tmp_path: Path) -> None:
    program = Autosave(tmp_path)
    folder = program.draft()
    (folder / "mesh.ply").write_text("ply")
    document.root = folder
    document.set(("seed",), 5)
    program.keep(document)
    end_without_closing(program)
    sweep(tmp_path)
    assert folder.exists(), "the work still refers to it"
    find(tmp_path)[0].discard()
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_draft_without_work_is_swept_away(tmp_path: Path) -> None:
    program = Autosave(tmp_path)
    folder = program.draft()
    end_without_closing(program)
    sweep(tmp_path)
    assert not folder.exists()


@pytest.mark.parametrize("root", ["..", "{stem}-0/..", "{stem}-0/../..", "other-0", ".", "{stem}-0/sub", "{stem}-x"])
def test_a_recovery_file_that_names_another_folder_takes_none_with_it(
    root: str, document: Document, tmp_path: Path
) -> None:
    kept = tmp_path / "state" / "kept"
    program = Autosave(kept)
    program.draft()
    document.set(("seed",), 5)
    program.keep(document)
    end_without_closing(program)
    stem = program.file.stem
    for folder in (f"{stem}-0/sub", "other-0", f"{stem}-x"):
        (kept / folder).mkdir()
    data = json.loads(program.file.read_text())
    data["root"] = f"{kept}/{root.format(stem=stem)}"
    program.file.write_text(json.dumps(data))
    before = {path for path in tmp_path.rglob("*") if path.is_dir()}
    (left,) = find(kept)
    assert not left.is_draft
    left.discard()
    assert {path for path in tmp_path.rglob("*") if path.is_dir()} == before


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": "blazer-recovery", "format_version": 99}', "\x00\xff"])
def test_a_damaged_file_is_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / "12-abcd.json").write_text(text, encoding="utf-8")
    assert find(tmp_path) == []


def test_a_folder_that_cannot_be_made_is_told(document: Document, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    document.set(("seed",), 5)
    with pytest.raises(InputError, match="cannot be kept"):
        Autosave(tmp_path / "file" / "kept").keep(document)


def end_without_closing(program: Autosave) -> None:
    """As a crash does: the system drops the lock, nothing is tidied up."""
    assert program._lock is not None
    program._lock.close()
    program._lock = None


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="the zone cannot be set there")
def test_when_work_was_kept_is_read_out_in_local_time(monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as east:
        east.setenv("TZ", "UTC-9")  # nine hours ahead, by POSIX
        time.tzset()
        assert read_out("2026-07-03 19:05:59+00:00") == "4 July 2026, 04:05"
    time.tzset()
    assert read_out("yesterday") == "yesterday"
