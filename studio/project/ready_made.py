"""Files that come with the program, meant by their name alone."""

from __future__ import annotations

import difflib
import json
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from render.base.errors import InputError
from render.base.model import Model
from studio.project.strict_json import read_object
from studio.project.validation_messages import input_error

Kind = TypeVar("Kind", bound=Model)


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


def load_model(model: type[Kind], path: Path | str, folder: Path, what: str) -> tuple[Kind, Path]:
    """A model's file and the folder that its paths start from; path and InputError as in `file_of`.

    InputError: one message for all that is wrong with the file.
    """
    file = file_of(path, folder, what)
    data = read_object(file, f"{what} file")
    try:
        return model.model_validate_json(json.dumps(data), strict=True), file.parent
    except ValidationError as error:
        raise input_error(error, model, data, str(file)) from None
