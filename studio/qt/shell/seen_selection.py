"""Commands that change what is selected do so where it can be seen: elsewhere Del would take a laser unawares."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtWidgets import QWidget

from studio.qt.core.session import Session

SHOWING = ("scene", "inspector")
"""Panels that show what is selected; the 3D view does as well."""


def where_seen(
    act: Callable[[Session], object], session: Session, docks: Mapping[str, QWidget], view: QWidget
) -> Callable[[], None]:
    """What a command does: `act`, or it says why it does not."""

    def done() -> None:
        if all(widget.isHidden() for widget in (view, *(docks[key] for key in SHOWING))):
            told = "nothing was changed: what is selected in the scene cannot be seen here; Set up shows it"
            session.message.emit("warning", told)
        else:
            act(session)

    return done
