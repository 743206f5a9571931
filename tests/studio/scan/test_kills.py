"""Killed at any file operation, the program leaves a folder that is whole, goes on to the same end, or says why not."""

from __future__ import annotations

import builtins
import io
import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from render.base.errors import InputError
from studio.project.document import replaced
from studio.project.project import Project
from studio.project.templates import new_project
from studio.scan import scan_folder
from studio.scan.reconstruct import reconstruct_folder
from studio.scan.stages import Clock
from tests.studio.small_scan import contents, scan, small_project

EACH = pytest.mark.parametrize("each", [8, pytest.param(1, marks=pytest.mark.validation)])
"""Killed at every eighth operation, or at every one, which takes minutes."""


class Killed(BaseException):
    """The program is gone: nothing catches it, and no file changes any more."""


class Death:
    """Counts the operations that change files, and ends the program before the n-th of them."""

    def __init__(self, at: float) -> None:
        self.at, self.count = at, 0

    def __call__(self) -> None:
        self.count += 1
        if self.count >= self.at:
            raise Killed


@contextmanager
def dying(at: float) -> Iterator[Death]:
    """The program dies before its `at`-th change of a file: creating, opening to write, renaming, removing."""
    death = Death(at)

    def wrapped(change: Callable[..., Any], writes: Callable[..., bool] = lambda *_, **__: True) -> Callable[..., Any]:
        def instead(*arguments: Any, **options: Any) -> Any:
            if writes(*arguments, **options):
                death()
            return change(*arguments, **options)

        return instead

    def to_write(file: Any, mode: str = "r", *_: Any, **__: Any) -> bool:
        return any(letter in mode for letter in "wax+")

    def creates(path: Any, flags: int, *_: Any, **__: Any) -> bool:
        return bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))

    with pytest.MonkeyPatch.context() as patch:
        for name in ("replace", "rename", "unlink", "remove", "mkdir", "rmdir"):
            patch.setattr(os, name, wrapped(getattr(os, name)))
        opened = wrapped(io.open, to_write)
        patch.setattr(io, "open", opened)
        patch.setattr(builtins, "open", opened)
        patch.setattr(os, "open", wrapped(os.open, creates))
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield death


def operations(work: Callable[[], object]) -> int:
    """How many operations of files a program takes."""
    with dying(float("inf")) as death:
        work()
    return death.count


def kill(work: Callable[[], object], at: int) -> None:
    with dying(at):
        try:
            work()
        except Killed:
            return
    raise AssertionError(f"it lived on beyond operation {at}")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """`project`; scans of it at two powers of its laser, `weak` and `strong`, each uninterrupted."""
    folder = tmp_path_factory.mktemp("made")
    file = small_project(folder / "project")
    scan(file, folder / "weak", project=powered(file, 0.001))
    scan(file, folder / "strong", project=powered(file, 0.01))
    return folder


def powered(file: Path, power: float) -> Project:
    return replaced(Project.load(file), ("scene", "rig", "lasers", 0, "power"), power)


@EACH
def test_a_scan_over_another_one_is_whole_or_unfinished_wherever_it_is_killed(
    made: Path, tmp_path: Path, each: int
) -> None:
    file, out = made / "project" / "project.json", tmp_path / "out"
    strong = powered(file, 0.01)
    wholes = [contents(made / name) for name in ("weak", "strong")]

    def begin_anew() -> None:
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(made / "weak", out)

    begin_anew()
    many = operations(lambda: scan(file, out, project=strong))
    assert contents(out) == wholes[1] and many > 50
    refused = finished = 0
    for n in range(1, many + 1, each):
        begin_anew()
        kill(lambda: scan(file, out, project=strong), n)
        try:
            scan_folder.open_folder(out)
            assert contents(out) in wholes, n
            finished += 1
        except InputError as error:
            assert "did not finish" in str(error), n
        try:
            scan(file, out, project=strong, resume=True)
        except InputError as error:
            assert "power: 0.001 in the frames, 0.01 in the project" in str(error), n
            refused += 1
            scan(file, out, project=strong)
        assert contents(out) == wholes[1], n
        assert [path.name for path in out.iterdir() if path.name.startswith(".")] == [], n
    assert 0 < finished < refused < many / 2 / each


def test_a_scan_that_is_resumed_again_and_again_ends_in_the_same_bytes(made: Path, tmp_path: Path) -> None:
    """Each time one operation further, with what the last attempt left."""
    file, out = made / "project" / "project.json", tmp_path / "out"
    strong = powered(file, 0.01)
    for n in range(3, 200, 7):
        with dying(n):
            try:
                scan(file, out, project=strong, resume=True)
                break
            except Killed:
                continue
    assert contents(out) == contents(made / "strong")


@EACH
def test_points_measured_again_are_the_manifest_s_or_it_tells_of_none(made: Path, tmp_path: Path, each: int) -> None:
    out = tmp_path / "out"

    def measure(method: str) -> None:
        found = scan_folder.open_folder(out)
        project = replaced(found.project, ("extraction", "method"), method)
        clock = Clock(lambda stage, done: None, lambda: False)
        reconstruct_folder(found, project, made / "project", out, clock, report=False, threads=1)

    shutil.copytree(made / "strong", out)
    points = {}
    for method in ("likelihood", "gaussian"):
        measure(method)
        points[method] = {name: data for name, data in contents(out).items() if name.startswith("points")}
    many = operations(lambda: measure("gaussian"))
    for n in range(1, many + 1, each):
        measure("likelihood")
        kill(lambda: measure("gaussian"), n)
        scan_folder.open_folder(out)  # the frames are whole all the time
        results = json.loads((out / "scan.json").read_text()).get("results")
        if results is not None:
            there = {name: data for name, data in contents(out).items() if name.startswith("points")}
            assert there == points[results[0]["method"]], n
        measure("gaussian")
        assert {name: data for name, data in contents(out).items() if name.startswith("points")} == points["gaussian"]
        assert [path.name for path in out.iterdir() if path.name.startswith(".")] == [], n


def test_a_project_is_saved_or_as_it_was_wherever_the_program_is_killed(made: Path, tmp_path: Path) -> None:
    old = powered(made / "project" / "project.json", 0.001)
    new = powered(made / "project" / "project.json", 0.01)
    texts = []
    for project in (old, new):
        project.save(tmp_path / "part.json")
        texts.append((tmp_path / "part.json").read_text())
    for n in range(1, operations(lambda: new.save(tmp_path / "part.json")) + 1):
        old.save(tmp_path / "part.json")
        kill(lambda: new.save(tmp_path / "part.json"), n)
        assert (tmp_path / "part.json").read_text() in texts


def test_a_new_project_is_there_as_a_whole_or_not_at_all(tmp_path: Path) -> None:
    many = operations(lambda: new_project("weld_seam", tmp_path / "made"))
    whole = {path.relative_to(tmp_path / "made") for path in (tmp_path / "made").rglob("*")}
    for n in range(1, many + 1):
        target = tmp_path / str(n)
        kill(lambda target=target: new_project("weld_seam", target), n)  # type: ignore[misc]
        there = {path.relative_to(target) for path in target.rglob("*")}
        assert there in (set(), whole), n
        new_project("weld_seam", target, force=bool(there))
