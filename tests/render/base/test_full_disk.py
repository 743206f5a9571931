"""Full disks are told in the same words by every writer, with real limits of the system and of SQLite."""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from render.base.errors import InputError
from render.base.files import atomic_write
from render.base.full_disk import is_full, no_room, require_room, size


@contextmanager
def files_of_at_most(count: int) -> Iterator[None]:
    """The system refuses larger ones to this process meanwhile, as a full disk would."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (count, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_file_that_may_grow_no_further_is_told_with_the_limit_and_stays_as_it_was(tmp_path: Path) -> None:
    target = tmp_path / "points.ply"
    target.write_text("old")
    message = r"points\.ply: there is no room.*File too large; allowed: at most 4\.1 kB a file; .*ulimit -f"
    with (
        files_of_at_most(4096),
        pytest.raises(InputError, match=message),
        atomic_write(target) as temporary,
    ):
        temporary.write_bytes(bytes(5000))
    assert target.read_text() == "old" and os.listdir(tmp_path) == ["points.ply"]


def test_libraries_that_hand_on_no_more_than_the_system_s_words_are_understood(tmp_path: Path) -> None:
    words = "Can't write data (file write failed: errno = 28, error message = 'No space left on device')"
    with (
        pytest.raises(InputError, match=r"no room.*No space left on device, [\d.]+ .*more than"),
        atomic_write(tmp_path / "set.h5") as temporary,
    ):
        temporary.write_bytes(bytes(1000))
        raise RuntimeError(words)
    with pytest.raises(RuntimeError, match="a fault"), atomic_write(tmp_path / "set.h5"):
        raise RuntimeError("a fault")
    assert os.listdir(tmp_path) == []


def test_sqlite_s_full_disk_is_one_and_a_locked_file_is_none(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "a", isolation_level=None) as database, sqlite3.connect(tmp_path / "a") as other:
        database.execute("CREATE TABLE a (b)")
        database.execute("PRAGMA max_page_count = 3")
        with pytest.raises(sqlite3.OperationalError) as full:
            database.execute("INSERT INTO a VALUES (?)", [bytes(100_000)])
        assert is_full(full.value)
        database.execute("BEGIN EXCLUSIVE")
        other.execute("PRAGMA busy_timeout = 0")
        with pytest.raises(sqlite3.OperationalError, match="locked") as locked:
            other.execute("INSERT INTO a VALUES (1)")
        assert not is_full(locked.value)


def test_room_is_asked_for_before_the_folder_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "new" / "study"
    disk = shutil.disk_usage(tmp_path)
    require_room(folder, disk.free // 2, "the study")
    with pytest.raises(InputError, match="the disk has no room for the study") as told:
        require_room(folder, disk.total + 1, "the study")
    assert size(disk.total + 1) in told.value.allowed and not folder.parent.exists()
    monkeypatch.setattr(shutil, "disk_usage", lambda path: type(disk)(0, 0, 0))  # of a system that does not tell
    require_room(folder, 10**18, "the study")
    assert str(no_room(folder, OSError(errno.ENOSPC, "full"))).count("free") == 0


@pytest.mark.parametrize(("count", "text"), [(0, "0 bytes"), (999, "999 bytes"), (1500, "1.5 kB"), (10**14, "100 TB")])
def test_sizes_are_for_people(count: int, text: str) -> None:
    assert size(count) == text
