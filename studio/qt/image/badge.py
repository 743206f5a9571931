"""What is said above the camera's picture: what it is of, where it is not a finished render of the scene as it is."""

from __future__ import annotations

from studio.qt.core.session import Session

OF_A_CELL = "Not of the project: the picture is of a study's cell, with values of its own."


def badge_text(session: Session, is_live: bool, ready: bool) -> str:
    """is_live: the live estimate is shown; ready: there is one. Empty: nothing is to be said."""
    shown = session.shown
    if is_live and session.problems and ready:
        return "Live estimate, but not of the scene as it is set: the scene tree marks what cannot be."
    if shown is None and not ready:
        return "Preparing the live estimate; the very first time this takes half a minute."
    if shown is None:
        return "Live estimate: one ray a pixel, lit from the camera, no noise. Render for the real image."
    if session.stale:
        return "Live estimate: the scene has changed since the render." if is_live else "The scene has changed."
    if is_live:
        return "Live estimate: one ray a pixel, lit from the camera, no noise."
    if shown.cell:
        return f"{OF_A_CELL} {shown.name}"
    return "Still refining." if not shown.final and session.dragging else ""
