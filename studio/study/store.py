"""Where a study's rows are kept: one SQLite file, written by the one driver, whole after any kill.

Rows are kept by their cell's key, so that the same cells measured anywhere, in any order, give the same table.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

from pydantic import ValidationError

from render.base.errors import InputError
from render.base.full_disk import is_full, no_room
from studio.project.project import Project
from studio.study.study import Study

FILE = "study.sqlite"
VERSION = 1
ROWS = "row (key TEXT PRIMARY KEY, measured TEXT, seconds TEXT)"

Row = dict[str, Any]


class Store:
    """The rows of one study. Use as a context; another program with the same folder is told apart by the lock."""

    def __init__(self, folder: Path, digest: str | None) -> None:
        """folder: exists. digest: of what the rows belong to; None: whatever it is, they are only looked at.

        InputError: the file is of another study, damaged, or of a newer version.
        """
        self.path = folder / FILE
        try:
            self._connection = sqlite3.connect(self.path, isolation_level=None)
            self._connection.execute("PRAGMA journal_mode = DELETE")
            self._connection.execute("PRAGMA synchronous = FULL")
            with self._transaction():
                for table in ("about (name TEXT PRIMARY KEY, value TEXT)", ROWS):
                    self._connection.execute(f"CREATE TABLE IF NOT EXISTS {table} STRICT")
            self._check(digest)
        except sqlite3.DatabaseError as error:
            raise InputError(
                "the study's store cannot be read",
                where=str(self.path),
                found=str(error),
                cure="restore it from a copy, or remove the folder and run the study anew",
            ) from None

    def _check(self, digest: str | None) -> None:
        with self._transaction():
            about = dict(self._connection.execute("SELECT name, value FROM about"))
            if not about and digest is not None:
                pairs = {"version": str(VERSION), "digest": digest}
                self._connection.executemany("INSERT INTO about VALUES (?, ?)", pairs.items())
                return
        if about.get("version") != str(VERSION):
            found, allowed = about.get("version"), str(VERSION)
            raise InputError(
                "the study's store is of another version", where=str(self.path), found=found, allowed=allowed
            )
        if digest is not None and about.get("digest") != digest:
            raise InputError(
                "the folder holds another study: its base project, fixed fields, image scale or program differ",
                where=str(self.path),
                cure="choose another folder with --out; only values, methods and repeats may be added to this one",
            )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """All that is done in it, or nothing. InputError: there is no room for it, or it may not be written."""
        try:
            self._connection.execute("BEGIN IMMEDIATE")
            yield
            self._connection.execute("COMMIT")
        except BaseException as error:
            with suppress(sqlite3.OperationalError):  # SQLite itself takes back what found no room
                self._connection.execute("ROLLBACK")
            if not isinstance(error, sqlite3.OperationalError):
                raise
            if is_full(error):
                raise no_room(self.path, error) from None
            what, cure = "the study's store cannot be written", "choose a folder that you may write to"
            raise InputError(what, where=str(self.path), found=str(error), cure=cure) from None

    def describe(self, study: Study, bases: Mapping[str, Project]) -> None:
        """Keep the study as it is now, with its base projects, so that the folder alone tells what it holds."""
        pairs = (("study", study.model_dump_json()), ("bases", json.dumps(bases_data(bases))))
        with self._transaction():
            self._connection.executemany("INSERT OR REPLACE INTO about VALUES (?, ?)", pairs)

    def add(self, rows: Iterable[tuple[str, Mapping[str, Any], Mapping[str, float]]]) -> None:
        """Keep key, measured numbers and seconds of several cells, all or none. What is there already stays."""
        lines = [(key, json.dumps(measured), json.dumps(seconds)) for key, measured, seconds in rows]
        with self._transaction():
            self._connection.executemany("INSERT OR IGNORE INTO row VALUES (?, ?, ?)", lines)

    def rows(self) -> dict[str, Row]:
        """Measured numbers and, as `seconds_...`, times of every cell by its key."""
        found = {}
        for key, measured, seconds in self._connection.execute("SELECT key, measured, seconds FROM row"):
            found[key] = {**json.loads(measured), **json.loads(seconds)}
        return found

    def count(self) -> int:
        """Cells that are measured."""
        return int(self._connection.execute("SELECT COUNT(*) FROM row").fetchone()[0])

    def merge(self, folder: Path, digest: str) -> int:
        """Add the rows of another folder's store; returns how many were new. InputError: it is of another study."""
        with Store(folder, digest) as store:
            lines = list(store._connection.execute("SELECT key, measured, seconds FROM row"))
        before = self.count()
        with self._transaction():
            self._connection.executemany("INSERT OR IGNORE INTO row VALUES (?, ?, ?)", lines)
        return self.count() - before

    def close(self) -> None:
        self._connection.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def described(folder: Path) -> tuple[Study, dict[str, Project]]:
    """The study that a folder holds, and its base projects. InputError: it holds none."""
    path = folder / FILE
    if not path.is_file():
        cure = "give the folder that study run wrote"
        raise InputError("the folder holds no study", where=str(folder), allowed=f"a folder with {FILE}", cure=cure)
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path.resolve()))}?mode=ro", uri=True)) as connection:
            about = dict(connection.execute("SELECT name, value FROM about"))
        study = Study.model_validate_json(about["study"])
        bases = bases_from(json.loads(about["bases"]), path)
    except (sqlite3.DatabaseError, KeyError, TypeError, AttributeError, ValidationError, json.JSONDecodeError):
        cure = "run the study again into another folder"
        raise InputError("the study's store cannot be read", where=str(path), cure=cure) from None
    return study, bases


def bases_data(bases: Mapping[str, Project]) -> dict[str, dict[str, str]]:
    """Base projects with their folders, as a file holds them."""
    return {name: {"project": base.to_text(), "folder": str(base.folder.resolve())} for name, base in bases.items()}


def bases_from(data: Mapping[str, Any], path: Path) -> dict[str, Project]:
    """The same from a file at `path`. InputError: one is none any more; KeyError, TypeError: it holds no bases."""
    return {
        name: Project.from_text(one["project"], f"{path}: {name}").in_folder(one["folder"])
        for name, one in data.items()
    }
