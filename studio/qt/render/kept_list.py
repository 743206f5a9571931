"""The renders that the open project keeps, as rows of the list of renders: their light is read when one is opened."""

from __future__ import annotations

import math
from pathlib import Path

from PySide6.QtGui import QIcon

from studio.project.date_and_time import read_out
from studio.qt.core.icons import SHAPES, drawn
from studio.qt.core.render import Render
from studio.qt.core.session import Session
from studio.scan.kept_renders import FIGURES, Kept, kept_renders, rename
from studio.scan.remarks import scale_name

Entry = Render | Kept
"""A render of the session, or one that is with the project and not open."""
MARK = " · kept"
MIDDLE = "translate(12 12) scale(0.42 0.5) translate(-12 -12)"
"""Of a thumbnail, which is wider than high by so much."""
OPENING = "Kept with the project, not open: a click reads its light and shows it."


class KeptList:
    """Those of a session's project as its folder held them when it was read last, the earliest first."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.all: list[Kept] = []
        self.wrong: list[str] = []
        """Of folders that hold no kept render any more: why."""
        self._root: Path | None = None

    def read(self) -> None:
        """Look into the project's folder; what is wrong there is told."""
        before, self._root = self.wrong, self._place()
        self.all, self.wrong = ([], []) if self._root is None else kept_renders(self._root)
        for text in self.wrong:
            if text not in before:
                self.session.message.emit("warning", f"A kept render cannot be read: {text}")

    @property
    def elsewhere(self) -> bool:
        """The project lies in another folder than was read."""
        return self._place() != self._root

    def rows(self) -> list[Entry]:
        """The session's renders, the latest first, then the kept ones; one that is open stands in its own place."""
        renders, folders = self.session.renders[::-1], {one.folder for one in self.all}
        opened = {one.kept: one for one in renders if one.kept in folders}
        own = [one for one in renders if opened.get(one.kept) is not one]
        return [*own, *(opened.get(one.folder, one) for one in self.all[::-1])]

    def of(self, entry: Entry) -> Kept | None:
        """What the project keeps of a row; None: nothing."""
        folder = entry.kept if isinstance(entry, Render) else entry.folder
        return next((one for one in self.all if folder is not None and one.folder == folder), None)

    def rename(self, kept: Kept, name: str) -> None:
        """InputError: its record cannot be written."""
        rename(kept, name)
        self.read()

    def _place(self) -> Path | None:
        document = self.session.document
        return None if document.path is None else document.root


def kept_lines(kept: Kept) -> list[str]:
    """Size and date, as a narrow list has room for."""
    camera, small = kept.project.scene.camera, scale_name(kept.image_scale)
    size = f"{camera.width} x {camera.height}" + (f", {small}" if small else "")
    return [size + (", stopped early" if kept.stopped else ""), read_out(kept.created)]


def kept_tip(kept: Kept) -> str:
    """The same with what was measured."""
    known = ((name, value) for name, value in kept.figures.items() if math.isfinite(value))
    figures = (f"{name} {value:.4g} {FIGURES[name]}" for name, value in known)
    return "\n".join([OPENING, ", ".join(kept_lines(kept)), *figures])


def place_holder() -> QIcon:
    """In place of a thumbnail: the light is on the disk."""
    return drawn(f"<g transform='{MIDDLE}' opacity='0.6'>{SHAPES['save']}</g>")
