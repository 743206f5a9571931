"""What is said above the camera's picture: what it is of, where it is not a finished render of the scene as it is."""

from __future__ import annotations

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QPushButton, QWidget

from studio.qt.core import theme
from studio.qt.core.scan_steps import awaits_step
from studio.qt.core.session import Session

LATE_MS = 600
"""From which reading a step takes long enough to be spoken of."""
OF_A_CELL = "Not of the project: the picture is of a study's cell, with values of its own."


class Badge(QFrame):
    """The text, and a button that asks for a render where one would help; hidden while there is nothing to say."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.text = QLabel(wordWrap=True)
        self.render_button = QPushButton("Render")
        self.render_button.clicked.connect(session.render_asked)
        self._of = False, False
        self._ground = ""
        self._late = QTimer(self, singleShot=True, interval=LATE_MS)
        self._late.timeout.connect(self._tell)
        row = QHBoxLayout(self)
        row.setContentsMargins(8, 3, 4, 3)
        row.addWidget(self.text, 1)
        row.addWidget(self.render_button)

    def tell(self, is_live: bool, ready: bool) -> None:
        """As `badge_text`. What is read in a moment is not spoken of, which would move the picture twice."""
        self._of = is_live, ready
        if not awaits_step(self.session):
            self._late.stop()
            self._tell()
        elif not self._late.isActive():
            self._late.start()

    def colour(self) -> None:
        """By the theme, and louder where what is shown is not of the scene as it is."""
        colours = theme.colours()
        ground = theme.mixed(colours.warning, colours.window, 0.3) if self.session.stale else colours.raised
        if ground != self._ground:  # a style sheet paints everything anew
            self._ground = ground
            self.setStyleSheet(f"QFrame, QLabel {{ background: {ground}; }}")

    def _tell(self) -> None:
        session, text = self.session, badge_text(self.session, *self._of)
        self.colour()
        self.text.setText(text)
        self.render_button.setVisible(session.shown is None or (session.stale and not awaits_step(session)))
        self.setVisible(bool(text))


def badge_text(session: Session, is_live: bool, ready: bool) -> str:
    """is_live: the live estimate is shown; ready: there is one. Empty: nothing is to be said."""
    shown = session.shown
    if is_live and session.problems and ready:
        return "Live estimate, but not of the scene as it is set: the scene tree marks what cannot be."
    if shown is None and not ready:
        return "Preparing the live estimate; the very first time this takes half a minute."
    if shown is None:
        return "Live estimate: one ray a pixel, lit from the camera, no noise. Render for the real image."
    if awaits_step(session) and not is_live:
        return f"Step {session.step + 1} is being read: this is still step {shown.frame.step + 1}."
    if session.stale and not session.changed:
        other = f"the render is of step {shown.frame.step + 1}"
        return f"Live estimate of step {session.step + 1}: {other}." if is_live else f"This is another step: {other}."
    if session.stale:
        return "Live estimate: the scene has changed since the render." if is_live else "The scene has changed."
    if is_live:
        return "Live estimate: one ray a pixel, lit from the camera, no noise."
    if shown.cell:
        return f"{OF_A_CELL} {shown.name}"
    return "Still refining." if not shown.final and session.dragging else ""
