"""Files that come with the program, meant by their name alone."""

from __future__ import annotations

import difflib
from pathlib import Path

from render.base.errors import InputError


def names_in(folder: Path) -> list[str]:
    """Names of the ready-made files of a folder."""
    return sorted(file.stem for file in folder.glob("*.json"))


def file_of(path: Path | str, folder: Path, what: str) -> Path:
    """The file meant by a path, or by the name of a ready-made one in the folder. InputError: neither.

    what: "study", for the message.
    """
    file = Path(path)
    if file.is_file() or file.suffix or len(file.parts) != 1:
        return file
    ready, names = folder / f"{file.name}.json", names_in(folder)
    if ready.is_file():  # also where a folder has that name, as a project's may
        return ready
    if file.exists():
        return file
    near = difflib.get_close_matches(file.name, names, n=1)
    raise InputError(
        f"there is no such {what}",
        found=str(path),
        allowed=f"a file, or a ready-made one: {', '.join(names)}",
        cure=f"did you mean {near[0]}?" if near else "",
    )
