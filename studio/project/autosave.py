"""Autosave and recovery: unsaved work is kept in a folder of its own, whole at any moment, until it is saved. Qt-free.

One file a running program. The program holds a lock beside it; the system drops the lock when the program ends,
however it ends, so that a file without a holder is what a crash left behind.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import secrets
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from render.base.errors import InputError
from render.base.files import atomic_write
from studio.project.date_and_time import now
from studio.project.document import Document
from studio.project.project import Project
from studio.project.strict_json import read_object

FORMAT, FORMAT_VERSION = "blazer-recovery", 1


@dataclass(frozen=True)
class Recovery:
    """Work that a crash left behind."""

    file: Path
    project: Project
    path: Path | None
    """The file it was opened from; None: it was never saved."""
    root: Path
    when: str
    on_disk: str | None
    """Digest of that file as the work knew it, so that nobody is asked about what nobody else has written."""

    def document(self) -> Document:
        """The work as a document with unsaved changes."""
        document = Document(self.project, None, self.root)
        document.path, document.on_disk = self.path, self.on_disk
        return document

    @property
    def is_draft(self) -> bool:
        """Its files are in a draft's folder, which goes with it."""
        # by its whole path, as `Autosave.draft` makes it: a damaged file may name any folder, also by ".."
        draft = re.escape(str(self.file.with_suffix("").absolute())) + r"-\d+"
        return re.fullmatch(draft, str(self.root)) is not None

    def discard(self) -> None:
        """It was opened, or is not wanted."""
        if self.is_draft:
            shutil.rmtree(self.root, ignore_errors=True)
        for file in (self.file, self.file.with_suffix(".lock")):
            with contextlib.suppress(OSError):
                file.unlink()


class Autosave:
    """Keeps one document at a time. A folder that cannot be written makes it do nothing: `keep` says so."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._stem = f"{os.getpid()}-{secrets.token_hex(4)}"
        self.file = folder / f"{self._stem}.json"
        self._lock: IO[bytes] | None = None
        self._kept: Project | None = None
        self._drafts: list[Path] = []

    def keep(self, document: Document) -> bool:
        """Write the document if it has changes that neither its file nor the last autosave holds.

        InputError: the folder cannot be written.
        """
        if not document.dirty:
            self.forget()
            return False
        if document.project is self._kept:
            return False
        self._hold()
        data = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "path": None if document.path is None else str(document.path.absolute()),
            "root": str(document.root.absolute()),
            "on_disk": document.on_disk,
            "when": now(),
            "project": document.project.model_dump(mode="json"),
        }
        with atomic_write(self.file) as temporary:
            temporary.write_text(json.dumps(data), encoding="utf-8")
        self._kept = document.project
        return True

    def draft(self) -> Path:
        """A new folder for the files of a project that has no folder yet. InputError: cannot be made."""
        self._hold()
        folder = self.folder / f"{self._stem}-{len(self._drafts)}"
        try:
            folder.mkdir(parents=True)
        except OSError as error:
            raise InputError("a new project has no place", where=str(folder), found=error.strerror) from error
        self._drafts.append(folder)
        return folder

    def forget(self) -> None:
        """The work is saved or given up: drop the file."""
        self._kept = None
        with contextlib.suppress(OSError):
            self.file.unlink()

    def close(self) -> None:
        """The program ends in order."""
        self.forget()
        for folder in self._drafts:
            shutil.rmtree(folder, ignore_errors=True)
        if self._lock is not None:
            self._lock.close()
            self._lock = None
            with contextlib.suppress(OSError):
                self.file.with_suffix(".lock").unlink()

    def _hold(self) -> None:
        if self._lock is not None:
            return
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            lock = open(self.file.with_suffix(".lock"), "wb")  # noqa: SIM115 - held until the program ends
        except OSError as error:
            raise InputError("unsaved work cannot be kept", where=str(self.folder), found=error.strerror) from error
        _lock(lock)
        self._lock = lock


def find(folder: Path) -> list[Recovery]:
    """What crashes left behind, latest first. Files of running programs are left alone, damaged ones passed over."""
    found = []
    for file in sorted(folder.glob("[0-9]*.json")):
        if not _held(file.with_suffix(".lock")):
            with contextlib.suppress(InputError):
                found.append(_read(file))
    return sorted(found, key=lambda recovery: recovery.when, reverse=True)


def find_of(folder: Path, project_file: Path) -> list[Recovery]:
    """Of these, the changes of one project file, wherever it is reached from."""
    return [left for left in find(folder) if left.path is not None and _same(left.path, project_file)]


def sweep(folder: Path) -> None:
    """Drop what crashes left behind beside the work: files half-written, drafts and locks that nothing refers to."""
    for path in (*folder.glob(".[0-9]*.json"), *folder.glob("[0-9]*-*-*"), *folder.glob("[0-9]*.lock")):
        stem = "-".join(path.name.lstrip(".").split(".")[0].split("-")[:2])
        if _held(folder / f"{stem}.lock"):
            continue
        if path.name.startswith("."):
            path.unlink(missing_ok=True)
        elif not (folder / f"{stem}.json").exists():
            shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink(missing_ok=True)


def _read(file: Path) -> Recovery:
    data: dict[str, Any] = read_object(file, "recovery file")
    if data.get("format") != FORMAT or data.get("format_version") != FORMAT_VERSION:
        raise InputError("not a recovery file of this version", where=str(file))
    path, root, project, on_disk = data.get("path"), data.get("root"), data.get("project"), data.get("on_disk")
    if not isinstance(root, str) or not isinstance(project, dict) or not isinstance(path, str | None):
        raise InputError("a damaged recovery file", where=str(file))
    loaded = Project.from_data(project, str(file))
    opened_from = None if path is None else Path(path)
    known = on_disk if isinstance(on_disk, str) else None
    return Recovery(file, loaded, opened_from, Path(root), str(data.get("when", "")), known)


def _same(path: Path, file: Path) -> bool:
    """A path of a damaged file may be none at all."""
    try:
        return path.samefile(file)
    except (OSError, ValueError):
        return False


def _held(lock: Path) -> bool:
    """A running program holds this lock."""
    try:
        with open(lock, "r+b") as file:
            return not _lock(file)
    except OSError:
        return False


def _lock(file: IO[bytes]) -> bool:
    """Lock an open file until it is closed; False: another program holds it."""
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
        else:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
