"""Escape, where nothing that is typed in or dragged takes it: what it ends of all that is under way in the window.

One shortcut of the window knows them all: of two that are for the same key, Qt calls neither.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from studio.qt.shell.window import MainWindow


def escape(window: MainWindow) -> None:
    """End what waits for a click, the tour, or a measure that is being added; of a job it is said how to stop it."""
    if window.panels.is_made("viewport") and cast(Any, window.panels["viewport"]).give_up():
        return
    if window.tour is not None:
        window.tour.end()
    elif window.panels.is_made("results") and cast(Any, window.panels["results"]).give_up():
        return
    elif window.status.job is not None:
        # it leaves fields, menus and drags: once too often must not cost an hour of work
        keys = window.commands["cancel"].shortcut().toString()
        window.session.message.emit("info", f"Esc does not stop the {window.status.job.name}; {keys} does")
