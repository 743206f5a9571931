"""What a long scan need not hold in memory: bytes in an unnamed file, of which a killed program leaves nothing."""

from __future__ import annotations

import tempfile
from pathlib import Path

from render.base.errors import InputError
from render.base.full_disk import is_full, no_room

IN_MEMORY = 1 << 20
"""Bytes that need no file."""


class Spool:
    """Grows at its end, and is read anywhere."""

    def __init__(self, folder: Path | None = None) -> None:
        """folder: where the file is, once there is one; made if missing. None: the system's temporary files."""
        self._folder = folder
        self._file = tempfile.SpooledTemporaryFile(IN_MEMORY, dir=None if folder is None else str(folder))  # noqa: SIM115 - it lives as long as this

    def append(self, data: bytes) -> int:
        """Where the bytes begin. InputError: the folder or the disk takes no more."""
        return self.put(data, None)

    def put(self, data: bytes, start: int | None) -> int:
        """In place of as many bytes from `start` on; None: at the end. As `append`."""
        try:
            if self._folder is not None:
                self._folder.mkdir(parents=True, exist_ok=True)
            start = self._file.seek(0, 2) if start is None else self._file.seek(start)
            self._file.write(data)
        except OSError as error:
            where = str(self._folder or tempfile.gettempdir())
            if is_full(error):
                raise no_room(where, error) from error
            what, cure = "the scan's results cannot be kept", "choose a folder that you may write to"
            raise InputError(what, where=where, found=error.strerror or error, cure=cure) from error
        return start

    def read(self, start: int, size: int) -> bytes:
        """At most `size` bytes from `start` on."""
        self._file.seek(start)
        return self._file.read(size)

    def close(self) -> None:
        self._file.close()
