"""What the desktop remembers from one start to the next: recent projects, theme, arrangement. Qt-free, one JSON file.

Nothing here is worth a failure: a damaged file is put aside, a folder that cannot be written forgets.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import PydanticSerializationError

from render.base.errors import InputError
from render.base.files import atomic_write, read_bytes
from studio.project.strict_json import parse_object

RECENT = 10
MOST_BYTES = 2**20
APPLICATION = "blazer-studio"


class Preferences(BaseModel):
    """Immutable; `changed` gives the next ones."""

    model_config = ConfigDict(frozen=True)

    recent: tuple[str, ...] = Field(default=(), max_length=RECENT)
    """Absolute paths, latest first."""
    theme: Literal["system", "dark", "light"] = "system"
    toured: bool = False
    """The tour was seen or skipped, so that the next start does not begin with it."""
    workspace: str = "setup"
    geometry: str = ""
    """Of the window, as Qt saves it, sealed with a checksum."""
    arrangements: dict[str, str] = {}
    """Of the panels in each workspace, as Qt saves them, sealed."""
    length_unit: Literal["mm", "um", "cm", "m", "in"] = "mm"
    """Of fields, from the next start."""
    threads: int | None = Field(default=None, ge=1, le=1024)
    """At most, of work in the window; None: all processors."""
    image_scale: Literal["full", "half", "quarter", "eighth"] = "full"
    """That a render begins with."""
    autosave: bool = True
    autosave_every: float = Field(default=20.0, ge=5.0, le=3600.0)
    """Seconds, while edits never rest."""
    undo_depth: int = Field(default=500, ge=10, le=10_000)
    folder: str = ""
    """Where a file was opened or saved last."""


class PreferencesFile:
    """The preferences of this person, kept in one file."""

    def __init__(self, folder: Path | None = None) -> None:
        """folder: None for the one that the system keeps for it."""
        self.path = (folder or config_folder()) / "preferences.json"
        self.trouble = ""
        """What a person should know of how they were read."""
        self.values = self._read()

    def change(self, **values: object) -> None:
        """Set some values, and write the file. Names that are no text, as Linux allows for files, are not kept."""
        changed = Preferences.model_validate({**dict(self.values), **values})
        try:
            text = changed.model_dump_json(indent=2) + "\n"
        except PydanticSerializationError:
            return
        self.values = changed
        with suppress(InputError, OSError), atomic_write(self.path) as temporary:
            temporary.write_text(text, encoding="utf-8")

    def add_recent(self, path: Path) -> None:
        """Put a project first in the list."""
        text = os.path.abspath(path)
        others = [entry for entry in self.values.recent if entry != text]
        self.change(recent=(text, *others)[:RECENT], folder=str(Path(text).parent))

    def forget_recent(self, path: Path | str) -> None:
        self.change(recent=tuple(entry for entry in self.values.recent if entry != str(path)))

    def _read(self) -> Preferences:
        if not os.path.lexists(self.path):
            return Preferences()
        try:
            text = read_bytes(self.path, MOST_BYTES, "preferences file").decode("utf-8")
            return Preferences.model_validate(parse_object(text, str(self.path), "preferences file"))
        except InputError as error:
            reason = error.what
        except UnicodeDecodeError:
            reason = "the preferences file is not UTF-8 text"
        except ValidationError as error:
            first = error.errors()[0]
            reason = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        aside = self.path.with_suffix(".damaged.json")
        try:
            os.replace(self.path, aside)
            self.trouble = f"Your preferences could not be read and start anew ({reason}); the file is kept as {aside}"
        except OSError:
            self.trouble = f"Your preferences could not be read and start anew ({reason}): {self.path}"
        return Preferences()


def config_folder() -> Path:
    """Where the system keeps a program's settings for this person."""
    import platformdirs

    return Path(platformdirs.user_config_dir(APPLICATION, appauthor=False))


def state_folder() -> Path:
    """Where the system keeps what a program left behind for this person."""
    import platformdirs

    return Path(platformdirs.user_state_dir(APPLICATION, appauthor=False))


def recovery_folder() -> Path:
    """Where unsaved work is kept in case of a crash."""
    return state_folder() / "recovery"
