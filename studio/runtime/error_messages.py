"""What went wrong, told to a person: what it is, why, what to do; the technical details apart. Qt-free."""

from __future__ import annotations

import traceback
from dataclasses import dataclass

from render.base.errors import InputError
from render.base.full_disk import is_full, no_room
from studio.runtime.place_words import in_words


@dataclass(frozen=True)
class Trouble:
    """The text of an error dialog."""

    title: str
    cause: str
    cure: str
    details: str = ""
    """For the log: a traceback, empty for bad input."""

    def __str__(self) -> str:
        return " ".join(
            part if part.endswith(".") else f"{part}." for part in (self.title, self.cause, self.cure) if part
        )


def trouble(error: BaseException, doing: str) -> Trouble:
    """doing: what failed, as it follows "could not" ("open the project")."""
    title = f"Could not {doing}"
    if is_full(error):
        error = no_room(getattr(error, "filename", None) or "the system's files", error)
    if isinstance(error, InputError):
        return Trouble(title, _cause(error), _sentence(error.cure) or "Nothing was changed.")
    details = "".join(traceback.format_exception(error))
    if isinstance(error, MemoryError):
        return Trouble(
            title,
            "There is not enough memory for it.",
            "Fewer pixels (a smaller image scale, where it renders), lighter meshes or smaller textures need less. "
            "The project is unharmed.",
            details,
        )
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        cause = f"{where}{error.strerror or error}."
        return Trouble(title, cause, "Check that the file is there and may be read and written.", details)
    return Trouble(
        title,
        f"The program has a fault here: {type(error).__name__}: {error}" if str(error) else type(error).__name__,
        "The project is unharmed: save it, and report the fault with the details from the log.",
        details,
    )


def _cause(error: InputError) -> str:
    lines = [_sentence(error.what)]
    if error.where:
        lines.append(f"Where: {in_words(error.where)}")
    if error.found is not None:
        text = str(error.found)
        lines.append(f"Found: {text if len(text) <= 300 else text[:297] + '...'}")
    if error.allowed:
        lines.append(f"Allowed: {error.allowed}")
    return "\n".join(lines)


def _sentence(text: str) -> str:
    text = text.strip()
    if not text:
        return ""
    text = text[0].upper() + text[1:]
    return text if text[-1] in ".!?:" or "\n" in text else text + "."
