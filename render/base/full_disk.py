"""Disks that take no more: how that is known, and the one message of it, whoever writes."""

from __future__ import annotations

import errno
import os
import shutil
import sqlite3
from pathlib import Path

from render.base.errors import InputError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
CURE = "make room, or choose a folder on another disk, then do it again; what is finished is kept"
CURE_LIMIT = "raise the limit (ulimit -f) or choose less, then do it again; what is finished is kept"
UNITS = ("bytes", "kB", "MB", "GB", "TB")


def is_full(error: BaseException) -> bool:
    """Whether a write failed for want of room: the disk, the user's share of it, or the size that files may have.

    Some libraries hand on the system's words alone, and SQLite does not even tell that a file may grow no further.
    """
    if isinstance(error, sqlite3.OperationalError):
        code = error.sqlite_errorcode & 0xFF
        return code == sqlite3.SQLITE_FULL or (code == sqlite3.SQLITE_IOERR and largest_file() is not None)
    return getattr(error, "errno", None) in FULL or any(os.strerror(code) in str(error) for code in FULL)


def no_room(path: Path | str, error: BaseException, written: int = 0) -> InputError:
    """What is told where `is_full`. written: bytes of the file that there was room for, which go with it."""
    words = getattr(error, "strerror", None) or str(error)
    found = next((os.strerror(code) for code in FULL if os.strerror(code) in words), words)
    what, limit, free = "there is no room for the file", largest_file(), free_bytes(Path(path))
    if limit is not None and (free is None or free > limit):
        return InputError(what, where=str(path), found=found, allowed=f"at most {size(limit)} a file", cure=CURE_LIMIT)
    if free is None:
        return InputError(what, where=str(path), found=found, cure=CURE)
    needed = f"it takes more than {size(free + written)}" if written else ""
    return InputError(what, where=str(path), found=f"{found}, {size(free)} free", allowed=needed, cure=CURE)


def require_room(folder: Path, needed: int, what: str) -> None:
    """InputError: the disk of a folder, which need not exist, has less free than `needed` bytes. what: is to go there.

    A system that does not tell is taken at its best.
    """
    free = free_bytes(folder)
    if free is not None and free < needed:
        found, allowed = f"{size(free)} free", f"about {size(needed)} or more"
        raise InputError(f"the disk has no room for {what}", where=str(folder), found=found, allowed=allowed, cure=CURE)


def free_bytes(path: Path) -> int | None:
    """On the disk of a path, for this user; None: it does not tell."""
    there = next((one for one in (path, *path.absolute().parents) if one.is_dir()), None)
    try:
        disk = shutil.disk_usage(there or Path.cwd())
    except OSError:
        return None
    return disk.free if disk.total > 0 else None


def largest_file() -> int | None:
    """Bytes that the system lets a file of this program have; None: as many as there is room for."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows has no such limit
        return None
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    return None if limit == resource.RLIM_INFINITY else limit


def size(count: int) -> str:
    """A number of bytes for a person: "12.3 MB"."""
    power = min((len(str(abs(count))) - 1) // 3, len(UNITS) - 1)
    return f"{count / 1000**power:.3g} {UNITS[power]}"
