"""What is known when a fault in native code ends the process: kept in a file, offered at the next start. Qt-free."""

from __future__ import annotations

import faulthandler
import os
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes

FILE, PUT_AWAY = "fault.txt", "last_fault.txt"
MOST = 10**7
"""Bytes; a dump is some ten thousand."""


@dataclass(frozen=True)
class Fault:
    """How an earlier process ended."""

    when: str
    text: str
    """Kind of fault, and where each of its threads was."""


def watch(folder: Path) -> None:
    """From now on a segmentation fault, an abort and their like are written down in the folder.

    Appended, so that several running programs share the file. Where nothing can be written, nothing is kept.
    """
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
        # a pipe of that name must not hold up the start
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | getattr(os, "O_NONBLOCK", 0)
        faulthandler.enable(open(os.open(folder / FILE, flags, 0o600), "ab", buffering=0))  # noqa: SIM115 - to the end


def last_fault(folder: Path) -> Fault | None:
    """What is in the file, which is put away under another name: it is told once. None: no process has ended so."""
    path = folder / FILE
    try:
        text = read_bytes(path, MOST).decode(errors="replace")
        when = datetime.fromtimestamp(path.stat().st_mtime).isoformat(sep=" ", timespec="minutes")
        if not text:
            return None
        with suppress(InputError), atomic_write(folder / PUT_AWAY) as temporary:
            temporary.write_text(text, encoding="utf-8")
        os.truncate(path, 0)  # not renamed: programs that run have it open
    except (InputError, OSError):
        return None
    return Fault(when, text)
