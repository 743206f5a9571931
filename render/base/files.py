"""Files that are either whole or absent, and paths that stay inside the project folder."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import stat
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PureWindowsPath

from render.base.errors import InputError
from render.base.full_disk import is_full, no_room

TEMPORARY = re.compile(r"\.(?P<stem>.+)\.[0-9a-f]{8}(?P<suffix>(\.[^.]*)?)")
ABANDONED = 3600.0
"""Age, s, above which a temporary file is abandoned: no write of this program takes so long."""


@contextmanager
def atomic_write(path: Path | str) -> Iterator[Path]:
    """Yield a temporary path beside `path` (same suffix) to write to; on success it replaces `path` in one step.

    The folder is made if missing. On any failure, Ctrl-C included, the temporary file goes and `path` stays as it was.

    InputError: the folder or the file cannot be written (permission, full disk, a folder or a device of that name).
    """
    target = Path(os.path.realpath(path))  # through a symlink, as plain writing would
    temporary = target.with_name(f".{target.stem[:100]}.{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise IsADirectoryError(None, "a folder of that name exists")
        if target.exists() and not target.is_file():  # replacing it would take a device from the system
            raise OSError(None, "it is a device or a pipe, not a regular file")
        temporary.touch(exist_ok=False)
        yield temporary
        with open(temporary, "r+b") as written:
            os.fsync(written.fileno())
        os.replace(temporary, target)
    except InputError:
        raise
    except Exception as error:
        if is_full(error):
            raise no_room(path, error, temporary.stat().st_size if temporary.is_file() else 0) from error
        named = {None, str(temporary), str(target), *map(str, target.parents)}
        about = getattr(error, "filename", None)
        if not isinstance(error, OSError) or (None if about is None else str(about)) not in named:
            raise  # a fault of the writer, or about another file, which it was reading
        raise InputError(
            "the file cannot be written",
            where=str(path),
            found=error.strerror or error,
            cure="choose a folder that you may write to",
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def unfinished_write(name: str) -> str | None:
    """The file's name that a temporary file of `atomic_write` was to get; None: the name is of no such file.

    A program that is killed leaves one behind; whoever knows that nobody writes there any more may remove it.
    """
    found = TEMPORARY.fullmatch(name)
    return found["stem"] + found["suffix"] if found else None


def remove_unfinished(target: Path, seconds: float = ABANDONED) -> None:
    """Remove what killed programs left of `target` so long ago that none can still be writing it."""
    with suppress(OSError):
        for name in os.listdir(target.parent):
            left = target.with_name(name)
            if unfinished_write(name) == target.name and time.time() - left.stat().st_mtime > seconds:
                left.unlink()


def remove_all_unfinished(folder: Path, is_own: Callable[[str], object]) -> None:
    """Remove what killed programs left of files in `folder` that are ours by their names.

    Only for the one program that may write there now. InputError: the folder cannot be read or written.
    """
    try:
        for name in os.listdir(folder):
            target = unfinished_write(name)
            if target is not None and is_own(target):
                (folder / name).unlink(missing_ok=True)
    except OSError as error:
        what = "what a program that was killed left half-written cannot be removed"
        raise InputError(what, where=str(folder), found=error.strerror or error, cure="remove it by hand") from None


def inside(root: Path, relative: str, where: str) -> Path:
    """The resolved path of `relative` below the folder `root`; it need not exist.

    where: the field that holds the path, for the message.
    InputError: `relative` is absolute, or leaves `root` by `..` or by a symbolic link.
    """
    base = os.path.realpath(root)
    allowed = "a path relative to the project file, inside its folder"
    cure = "copy the file into the project folder"
    # Windows' rules are applied as well, so that a project is valid on every system.
    if not relative or "\0" in relative or os.path.isabs(relative) or PureWindowsPath(relative).anchor:
        raise InputError("the path is not relative", where=where, found=relative, allowed=allowed, cure=cure)
    resolved = Path(os.path.realpath(os.path.join(base, relative)))
    if not resolved.is_relative_to(base):
        raise InputError("the path leaves the project folder", where=where, found=relative, allowed=allowed, cure=cure)
    return resolved


def read_bytes(path: Path, most: int, what: str = "file", where: str | None = None) -> bytes:
    """The bytes of a regular file of at most `most` bytes; its size is looked at before anything is read.

    where: the field that names it, for the message; without one, its path.
    InputError: missing, a folder, a device or a pipe, larger than that, or not readable.
    """
    where = str(path) if where is None else where
    try:
        # a pipe that nobody writes to would block the opening itself
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        try:
            status = os.fstat(descriptor)
            _check_regular(status, most, what, where)
            with open(descriptor, "rb", closefd=False) as file:
                data = file.read(status.st_size)
        finally:
            os.close(descriptor)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"there is no such {what}", where=where) from None
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"the {what} cannot be read", where=where, found=reason) from None
    return data


def check_regular(path: Path, most: int, what: str = "file", where: str | None = None) -> None:
    """InputError: `path` is no regular file of at most `most` bytes. For readers that open the file themselves."""
    where = str(path) if where is None else where
    try:
        _check_regular(os.stat(path), most, what, where)
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"there is no such {what}", where=where) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"the {what} cannot be read", where=where, found=reason) from None


def _check_regular(status: os.stat_result, most: int, what: str, where: str) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"the {what} is a folder", where=where)
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"the {what} is not a regular file", where=where, found="a device or a pipe")
    if status.st_size > most:
        found = f"{status.st_size} bytes"
        raise InputError(f"the {what} is too big", where=where, found=found, allowed=f"{most} bytes")


def sha256(path: Path) -> str:
    """SHA-256 of a regular file's bytes, 64 lower-case hexadecimal digits. InputError: it is none, or not readable."""
    check_regular(path, sys.maxsize)
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError("the file cannot be read", where=str(path), found=error.strerror or error) from error
