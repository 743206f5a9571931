"""One program at a time in a folder of results. The system drops the lock with its holder, however that ends."""

from __future__ import annotations

import errno
import json
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from render.base.errors import InputError
from render.base.files import read_bytes
from studio.project.date_and_time import now

LOCK = ".scan.lock"
LONGEST = 4096
"""Bytes of what a holder says of itself."""


@contextmanager
def hold(folder: Path, *, reading: bool = False) -> Iterator[None]:
    """Keep the folder, which is made if missing, for this program.

    reading: nothing is written there, so that a folder that cannot be written to needs no lock.
    InputError: another program holds it, and which; or the folder cannot be written.
    """
    path = folder / LOCK
    lock = FileLock(path, timeout=0, on_acquired=_sign)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise InputError(
            "another program works in this folder",
            where=str(folder),
            found=_holder(path),
            cure="wait until it has ended, or choose another folder with --out",
        ) from None
    except OSError as error:
        if not reading or error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS):
            what, found = "the folder cannot be locked", error.strerror or error
            raise InputError(what, where=str(folder), found=found, cure="choose another folder with --out") from None
    try:
        yield
    finally:
        try:
            if lock.is_locked and os.name != "nt":  # who opened the file before sees that it has no name any more
                with suppress(OSError):
                    path.unlink()
        finally:
            lock.release()


def _sign(descriptor: int) -> None:
    """Write into the lock who holds it."""
    holder = {
        "pid": os.getpid(),
        "host": socket.gethostname(),
        "since": now(),
        "command": " ".join(Path(word).name if i == 0 else word for i, word in enumerate(sys.argv))[:1000],
    }
    with suppress(OSError):  # a full disk: the lock holds all the same
        os.ftruncate(descriptor, 0)
        os.write(descriptor, json.dumps(holder).encode())


def _holder(path: Path) -> str:
    """Who holds a lock, for a person."""
    try:
        said: dict[str, Any] = json.loads(read_bytes(path, LONGEST))
        words = f"process {said['pid']} on {said['host']}, since {said['since']}: {said['command']}"
    except (InputError, ValueError, KeyError, TypeError):  # just begun, or the system keeps a lock from being read
        return "a program that does not say which"
    return "".join(letter if letter.isprintable() else "?" for letter in words)
