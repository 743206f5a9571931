"""Which files may be read: of those that a project names the ones in its folder, of those of the command line any."""

from __future__ import annotations

from pathlib import Path

from render.base.files import inside

_of_command_line: set[str] = set()


def of_command_line(file: Path) -> str:
    """The absolute path of a file of the command line, which may then lie anywhere."""
    path = str(file.absolute())
    _of_command_line.add(path)
    return path


def allowed_file(root: Path, path: str, where: str) -> Path:
    """The file that a project in the folder `root` names in the field `where`. InputError: it lies elsewhere."""
    return Path(path) if path in _of_command_line else inside(root, path, where)
