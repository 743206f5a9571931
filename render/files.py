"""Files that are either whole or absent, and paths that stay inside the project folder."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PureWindowsPath

from render.errors import InputError


@contextmanager
def atomic_write(path: Path | str) -> Iterator[Path]:
    """Yield a temporary path beside `path` (same suffix) to write to; on success it replaces `path` in one step.

    The folder is made if missing. On any failure, Ctrl-C included, the temporary file goes and `path` stays as it was.

    InputError: the folder or the file cannot be written (permission, full disk, a folder of that name).
    """
    target = Path(os.path.realpath(path))  # through a symlink, as plain writing would
    temporary = target.with_name(f".{target.stem[:100]}.{secrets.token_hex(4)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise IsADirectoryError(None, "a folder of that name exists")
        temporary.touch(exist_ok=False)
        yield temporary
        with open(temporary, "r+b") as written:
            os.fsync(written.fileno())
        os.replace(temporary, target)
    except OSError as error:
        named = {None, str(temporary), str(target), *map(str, target.parents)}
        if (None if error.filename is None else str(error.filename)) not in named:
            raise  # about another file, which the writer was reading
        raise InputError(
            "the file cannot be written",
            where=str(path),
            found=error.strerror or error,
            cure="choose a folder that you may write to and that has free space",
        ) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def inside(root: Path, relative: str, where: str) -> Path:
    """The resolved path of `relative` below the folder `root`; it need not exist.

    where: the field that holds the path, for the message.
    InputError: `relative` is absolute, or leaves `root` by `..` or by a symbolic link.
    """
    base = os.path.realpath(root)
    allowed = "a path relative to the project file, inside its folder"
    cure = "copy the file into the project folder"
    # Windows' rules are asked as well, so that a project is as safe there as here.
    if not relative or "\0" in relative or os.path.isabs(relative) or PureWindowsPath(relative).anchor:
        raise InputError("the path is not relative", where=where, found=relative, allowed=allowed, cure=cure)
    resolved = Path(os.path.realpath(os.path.join(base, relative)))
    if not resolved.is_relative_to(base):
        raise InputError("the path leaves the project folder", where=where, found=relative, allowed=allowed, cure=cure)
    return resolved


def sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, 64 lower-case hexadecimal digits. InputError: the file cannot be read."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise InputError("the file cannot be read", where=str(path), found=error.strerror or error) from error
