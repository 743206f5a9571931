"""The open project: edits, undo and redo, what is saved. Qt-free; projects are frozen, so history is a list of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from render.base.errors import InputError
from render.base.files import sha256
from studio.project.input_files import input_files
from studio.project.project import Project
from studio.project.templates import FOLDER as TEMPLATES
from studio.project.validation_messages import input_error

FieldPath = tuple[str | int, ...]
"""Where a value stands in the project: ("scene", "rig", "lasers", 0, "power")."""

HISTORY = 500


@dataclass(frozen=True)
class Edit:
    """One entry of the history: its name as a menu shows it, and the project before it."""

    label: str
    before: Project
    merge: str


class Document:
    """The only place where the current project changes. Listeners are called after every change, in order."""

    depth = HISTORY
    """Edits that can be undone, of every document."""

    def __init__(self, project: Project, path: Path | None = None, root: Path | None = None) -> None:
        """path: the file it is saved in, None for a new one; root: the folder its mesh paths are relative to."""
        self.project = project
        self.path = path
        self.root = root if root is not None else path.parent if path is not None else Path.cwd()
        self._saved: Project | None = project if path is not None else None
        self.on_disk = _digest(path)
        """Of the file's bytes when it was read or written here; None: it was not."""
        self._undo: list[Edit] = []
        self._redo: list[Edit] = []
        self.listeners: list[Callable[[], None]] = []

    @property
    def dirty(self) -> bool:
        """There are changes that no file holds."""
        return self.project != self._saved

    @property
    def files_may_go(self) -> bool:
        """It has no folder of its own yet: meshes and textures lie where they stay only as long as the window."""
        return self.path is None and self.root.parent != TEMPLATES and bool(input_files(self.project.scene, self.root))

    @property
    def saved(self) -> Project | None:
        """As the file at `path` holds it; None: it was never saved."""
        return self._saved

    @property
    def changed_on_disk(self) -> bool:
        """Somebody else has written the file since it was read or written here: saving would lose what they did."""
        now = _digest(self.path)
        return now is not None and now != self.on_disk

    @property
    def undo_label(self) -> str | None:
        return self._undo[-1].label if self._undo else None

    @property
    def redo_label(self) -> str | None:
        return self._redo[-1].label if self._redo else None

    def apply(self, label: str, project: Project, merge: str = "") -> None:
        """Make `project` current. Consecutive edits with the same non-empty `merge` are undone as one (a drag)."""
        if project == self.project:
            return
        if not (merge and self._undo and self._undo[-1].merge == merge and not self._redo):
            self._undo.append(Edit(label, self.project, merge))
            del self._undo[: -self.depth]
        self._redo.clear()
        self.project = project
        self._tell()

    def end_merge(self) -> None:
        """The next edit starts a new entry, whatever its `merge` (the mouse was released)."""
        if self._undo and self._undo[-1].merge:
            self._undo[-1] = Edit(self._undo[-1].label, self._undo[-1].before, "")

    def set(self, path: FieldPath, value: Any, label: str = "", merge: str = "") -> None:
        """Change one value. InputError: what is wrong with it; nothing has changed then."""
        self.apply(label or f"change {path[-1]}", replaced(self.project, path, value), merge)

    def undo(self) -> None:
        self._step(self._undo, self._redo)

    def redo(self) -> None:
        self._step(self._redo, self._undo)

    def _step(self, back: list[Edit], forth: list[Edit]) -> None:
        """Take the last edit of one list back; the other one leads to the project as it is now."""
        if back:
            edit = back.pop()
            forth.append(Edit(edit.label, self.project, ""))
            self.project = edit.before
            self._tell()

    def save(self, path: Path | None = None, name: str | None = None) -> None:
        """Write the file, under another name of the project if one is given, whole or not at all.

        The name is no edit: undo and redo lead to projects that have it. InputError: it cannot be written; the document
        is unharmed.
        """
        target = path or self.path
        if target is None:
            raise InputError("the project has no file yet", where=self.project.name, cure="use Save as")
        project = self.project if name is None else replaced(self.project, ("name",), name)
        project = project.save(target)
        if name is not None:
            old = self.project.name
            self._undo, self._redo = (_renamed(edits, old, name) for edits in (self._undo, self._redo))
        self.path, self.root, self.project, self._saved = target, target.parent, project, project
        self.on_disk = _digest(target)
        self._tell()

    def _tell(self) -> None:
        for listener in list(self.listeners):
            listener()


def _digest(path: Path | None) -> str | None:
    """Of a file's bytes; None: there is none, or it cannot be read."""
    try:
        return None if path is None else sha256(path)
    except InputError:
        return None


def _renamed(edits: list[Edit], old: str, name: str) -> list[Edit]:
    """With another name of the projects before that have the old one."""
    return [
        replace(edit, before=edit.before.model_copy(update={"name": name})) if edit.before.name == old else edit
        for edit in edits
    ]


def value_at(project: Project, path: FieldPath) -> Any:
    """The value at a path. KeyError: there is none."""
    value: Any = project
    for key in path:
        try:
            value = value[key] if isinstance(key, int) else getattr(value, key)
        except (AttributeError, IndexError, TypeError):
            raise KeyError(path) from None
    return value


def replaced(project: Project, path: FieldPath, value: Any) -> Project:
    """The project with one value changed, validated as a whole. InputError names the field and what is allowed.

    The report goes on judging an object that gets another name.
    """
    try:
        result = _replaced(project, path, value)
        renamed = path[:2] == ("scene", "objects") and path[3:] == ("name",)
        if renamed and value_at(project, path) == project.delivery.surface_of:
            result = _replaced(result, ("delivery", "surface_of"), value)
    except ValidationError as error:
        raise input_error(error, Project, {}, "") from None
    assert isinstance(result, Project)
    return result


def _replaced(node: Any, path: FieldPath, value: Any) -> Any:
    if not path:
        return value
    key, rest = path[0], path[1:]
    if isinstance(key, int):
        items = list(node)
        items[key] = _replaced(items[key], rest, value)
        return tuple(items)
    assert isinstance(node, BaseModel)
    fields = {name: getattr(node, name) for name in type(node).model_fields}
    fields[str(key)] = _replaced(fields[str(key)], rest, value)
    return type(node).model_validate(fields)
